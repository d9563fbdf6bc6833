"""A state of a stored run, with the fields of a state in the loop."""

from __future__ import annotations

from typing import Any

from warmslip.io.stored_contact import StoredContact
from warmslip.model.contact_output import ContactFields
from warmslip.model.discretisation import Discretisation
from warmslip.model.state import StressFields
from warmslip.typing import Array


class StoredState(StressFields):
    """A stored state: u, w (nodes, d) and theta (nodes,), None for a field that the scene does not have.

    `step` is the number of its step, 0 at the start; `contact` holds the contact fields of the run.
    """

    def __init__(
        self,
        discretisation: Discretisation,
        contact: StoredContact,
        *,
        step: int,
        time: float,
        fields: tuple[Array | None, Array | None, Array | None],
    ) -> None:
        self.discretisation, self._contact, self.step, self.time = discretisation, contact, step, time
        self.u, self.w, self.theta = fields

    @property
    def _straining(self) -> tuple[Any, Any, Any]:
        return self.u, self.w, self.theta

    def contact_on(self, part: str | None = None) -> ContactFields:
        """Contact fields of a part, see `Trajectory.contact_on`. Raises ValueError for a part without contact points, and at
        the start, where no forces are known."""
        if self.step == 0:
            raise ValueError("the state is the start of the run, where no contact forces are known; give a later time")
        return self._contact.near(part, self.time)
