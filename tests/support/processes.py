"""Processes of their own."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable

from support.folders import TESTS

Command = Callable[..., subprocess.CompletedProcess[str]]


def child_environment() -> dict[str, str]:
    """This process's environment without the marks of its own MPI, so that children start MPI afresh and find `support`."""
    marks = ("OMPI_COMM_", "OMPI_UNIVERSE", "OMPI_FILE_", "OMPI_NUM_", "OMPI_FIRST_", "PMIX_", "PRTE_LAUNCHED", "PMI_")
    own = {k: v for k, v in os.environ.items() if not k.startswith(marks)}
    settings = {
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_NUM_THREADS": "1",
        "OMPI_ALLOW_RUN_AS_ROOT": "1",
        "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
        "OMPI_MCA_rmaps_base_oversubscribe": "1",
        "OMPI_MCA_mpi_yield_when_idle": "1",
        "OMPI_MCA_ess_singleton_isolated": "1",
        "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    }
    search = ":".join(filter(None, [str(TESTS), own.get("PYTHONPATH", "")]))  # `import support`
    return settings | own | {"PYTHONPATH": search}
