"""Checks of the verification report from codes that share nothing with the core: python tests/independent_checks.py OUT.csv"""

from __future__ import annotations

import itertools
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE / "core")]

import test_against_skfem as codes  # noqa: E402
import test_exact_discrete as exact  # noqa: E402

from warmslip.records import check  # noqa: E402
from warmslip.studies.refinement_study import stamp  # noqa: E402

TITLE = "The same scheme by others: exact rational arithmetic on a few cells, scikit-fem, SciPy"


def main(out: Path) -> None:
    found = [one for name, case in exact.CASES.items() for one in exact.advance(name, case)[0]]
    for code, (reading, theta, coupling) in itertools.product(codes.CODES, codes.CASES):
        found += codes.lines(code, reading, theta, coupling)
    check.write(out, found, stamp(None, title=TITLE))
    print(f"{sum(one.passed for one in found)} of {len(found)} checks")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
