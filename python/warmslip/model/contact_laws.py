"""Contact laws of one's own: Python functions in the place of the scene's compliance or friction."""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from warmslip.typing import Array

AGREEING = 0.9  # share of the samples whose derivative must be the difference quotient: a law may have kinks
DERIVATIVE_TOLERANCE = 1e-3  # how close the two must be, relative
ENERGY_TOLERANCE = 1e-6  # relative, of an energy against its pressure: an energy found by quadrature may be so far off
CANCELLED = 1e-12  # relative to the largest of the trial: a formula may lose the digits of small values
SAMPLE_FACTOR = 0.97531  # from round numbers, where kinks are: factor of the places of the trial
MAX_SAMPLE_PENETRATION = 1e-2  # penetration of the trial, over the size of the body
MEMORY_RATIO = 1.02  # ratio of the penetrations that are remembered

Triple = tuple[float, float, float]


@dataclass(frozen=True, kw_only=True)
class Law:
    """Functions in the place of a contact part's own law, None for the one of the scene.

    They generalise (2.8) and (2.9) of the paper. Both are called with floats at every contact point in every iteration, which
    is slower than the laws of the scene. They are tried on samples before the run, and every value is checked in the run: a
    step that meets a value that is none ends the run with the outcome `law_failed`. A derivative that is wrong beyond the
    samples costs iterations only.

    Parameters
    ----------
    compliance : callable, optional
        `compliance(r)` for a penetration r > 0 (length): the pressure p_nu (stress, not negative, not falling with r), its
        derivative, and the energy per area, the integral of p_nu from 0 to r.
    friction : callable, optional
        `friction(pressure, speed)`: the friction bound (stress, not negative) and its derivatives by the pressure and by the
        slip speed.

    Raises
    ------
    ValueError
        For a law without functions.
    TypeError
        For a function that cannot be called.
    """

    compliance: Callable[[float], Sequence[float]] | None = None
    friction: Callable[[float, float], Sequence[float]] | None = None

    def __post_init__(self) -> None:
        if self.compliance is None and self.friction is None:
            raise ValueError("a Law needs a function; give compliance=, friction= or both")
        for name in ("compliance", "friction"):
            function = getattr(self, name)
            if function is not None and not callable(function):
                raise TypeError(f"Law({name}={function!r}) is no function; give one that can be called")

    def names(self, part: str) -> list[str]:
        """Which functions there are."""
        return [f"laws.{part}.{name}" for name in ("compliance", "friction") if getattr(self, name) is not None]

    def validate(self, part: str, length: float) -> CheckedLaw:
        """The functions, tried on penetrations up to a hundredth of `length`, the pressures these give, and slip speeds.

        Raises ValueError with the place where a function is not what it should be.
        """
        watched = CheckedLaw.of(part, self, length)
        pressures = SAMPLE_FACTOR * np.geomspace(1e-6, 1e2, 9)
        if watched.compliance is not None:
            r = SAMPLE_FACTOR * np.geomspace(1e-8, MAX_SAMPLE_PENETRATION, 61) * length
            pressures = np.array([watched.compliance.validate(float(one))[0] for one in r])[::8]
            _derives(watched.compliance, r[:, None], axis=0)
        if watched.friction is not None:
            for p in (0.0, *pressures):
                watched.friction.validate(float(p), 0.0)
            places = [(p, speed) for p in pressures if p > 0 for speed in SAMPLE_FACTOR * np.geomspace(1e-3, 10, 9)]
            for axis in (0, 1) if places else ():
                _derives(watched.friction, np.array(places), axis=axis)
        return watched


class CheckedFunction:
    """A function of a law as the core calls it: what it gives is tried each time, and what cannot be becomes `nothing`.

    A step whose answer lies there fails, on all ranks alike; an iterate that went too far is brought back by the
    safeguards of the contact solver. `violation` has the reason for the least place since `reset`.
    """

    nothing: Triple = (math.nan, math.nan, math.nan)

    def __init__(self, name: str, function: Callable[..., Sequence[float]], length: float) -> None:
        self.name, self._function, self._length = name, function, length
        self.reset()

    def reset(self) -> None:
        """Before a step: what went wrong in iterates of the last one is of no consequence."""
        self.violation: str | None = None
        self._least = math.inf

    def fresh_copy(self) -> CheckedFunction:
        """The same function, of which nothing is known yet."""
        return type(self)(self.name, self._function, self._length)

    def __call__(self, *place: float) -> Triple:
        if not all(map(math.isfinite, place)):  # the step has failed before
            return self.nothing
        try:
            return self.validate(*place)
        except ValueError as error:
            if place[0] < self._least:
                self.violation, self._least = str(error), place[0]
            return self.nothing

    def validate(self, *place: float) -> Triple:
        """The three values. Raises ValueError with the place for what is no value of a law."""
        at = ", ".join(f"{x:.3g}" for x in place)
        try:
            one, two, three = (float(value) for value in self._function(*place))
        except Exception as error:
            raise ValueError(f"{self.name}({at}) raised {error!r}; it must give three numbers") from error
        if not (math.isfinite(one) and math.isfinite(two) and math.isfinite(three)):
            raise ValueError(f"{self.name}({at}) gave {[one, two, three]}; it must give three finite numbers")
        if one < 0:
            raise ValueError(f"{self.name}({at}) gave {one:.3g}, which is negative; a pressure or a bound is not")
        return one, two, three


class CheckedCompliance(CheckedFunction):
    """A compliance, which must also agree with itself: between two penetrations the energy grows by the pressure."""

    nothing = (math.inf, math.inf, math.inf)  # whatever comes there is pressed back

    def __init__(self, name: str, function: Callable[..., Sequence[float]], length: float) -> None:
        super().__init__(name, function, length)
        self._met = [(0.0, 0.0, 0.0)]  # penetration, pressure, energy: ascending, at least a ratio MEMORY_RATIO
        self._most = 0.0, 0.0  # pressure and energy of the trial

    @property
    def too_far(self) -> bool:
        """Whether it was asked in vain for penetrations larger than the body alone."""
        return self._length < self._least < math.inf

    def validate(self, *place: float) -> Triple:
        (r,) = place
        pressure, slope, energy = super().validate(r)
        if r <= MAX_SAMPLE_PENETRATION * self._length:
            self._most = max(self._most[0], pressure), max(self._most[1], energy)
        here, at = (r, pressure, energy), bisect.bisect(self._met, (r,))
        under, over = self._met[at - 1], self._met[at : at + 1]
        pairs = [(under, here), *((here, one) for one in over)]
        for pair in pairs:
            self._does_not_fall(*pair)
        off = CANCELLED * self._most[1]
        if not -off <= energy <= r * pressure * (1 + ENERGY_TOLERANCE) + off:
            raise ValueError(
                f"{self.name}({r:.3g}): the energy is {energy:.6g}, and the integral from 0 of a pressure that does not "
                f"fall lies between 0 and {r * pressure:.6g}; it starts at 0"
            )
        for pair in pairs:
            self._is_the_integral(*pair)
        if r > MEMORY_RATIO * under[0] and all(one[0] > MEMORY_RATIO * r for one in over):
            self._met.insert(at, here)
        return pressure, slope, energy

    def _does_not_fall(self, one: Triple, other: Triple) -> None:
        if one[1] > other[1] * (1 + ENERGY_TOLERANCE) + CANCELLED * self._most[0]:
            raise ValueError(f"{self.name}: the pressure falls from r = {one[0]:.3g} to {other[0]:.3g}; it must not")

    def _is_the_integral(self, one: Triple, other: Triple) -> None:
        """The energy of a pressure that does not fall grows by something between the lower and the upper rectangle."""
        (r, p, energy), (r_next, p_next, energy_next) = one, other
        low, high, grown = p * (r_next - r), p_next * (r_next - r), energy_next - energy
        off = ENERGY_TOLERANCE * energy_next + CANCELLED * self._most[1]
        if not low - off <= grown <= high + off:
            raise ValueError(
                f"{self.name}: from r = {r:.6g} to {r_next:.6g} the energy grows by {grown:.9g} and the pressure gives "
                f"{low:.9g} to {high:.9g}; the third value is the integral of the first"
            )


@dataclass(frozen=True)
class CheckedLaw:
    """The functions of a law in the hands of one problem."""

    compliance: CheckedCompliance | None = None
    friction: CheckedFunction | None = None

    @classmethod
    def of(cls, part: str, law: Law, length: float) -> CheckedLaw:
        """The functions of the law of a contact part of a body of size `length`, of which nothing is known yet."""
        return cls(
            law.compliance and CheckedCompliance(f"laws.{part}.compliance", law.compliance, length),
            law.friction and CheckedFunction(f"laws.{part}.friction", law.friction, length),
        )

    @property
    def functions(self) -> list[CheckedFunction]:
        return [one for one in (self.compliance, self.friction) if one is not None]

    @property
    def violation(self) -> str | None:
        """Why the step failed, if it was for one of the functions: a penetration beyond the body is only an iterate's."""
        far = self.compliance is not None and self.compliance.too_far
        return next((one.violation for one in self.functions if one.violation and not far), None)


def _derives(law: CheckedFunction, places: Array, *, axis: int) -> None:
    """The derivative by an argument is the difference quotient, but at kinks."""
    step = np.zeros_like(places)
    step[:, axis] = 1e-5 * places[:, axis]

    def values(at: Array) -> Any:
        return np.array([law.validate(*map(float, place)) for place in at]).T

    over, under, here = (values(places + sign * step) for sign in (1, -1, 0))
    quotient, stated = (over[0] - under[0]) / (2 * step[:, axis]), here[1 + axis]
    size = np.maximum(np.abs(quotient), np.abs(stated))
    wrong = np.abs(quotient - stated) > DERIVATIVE_TOLERANCE * size + 1e-9 * np.abs(here[0]) / places[:, axis]
    if wrong.mean() > 1 - AGREEING:
        i = int(np.flatnonzero(wrong)[0])
        at = ", ".join(f"{x:.3g}" for x in places[i])
        raise ValueError(
            f"{law.name}({at}): the derivative by argument {axis + 1} is given as {stated[i]:.6g}, a difference quotient says "
            f"{quotient[i]:.6g}; correct the {('second', 'third')[axis]} value"
        )
