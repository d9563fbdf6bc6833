#!/usr/bin/env python
"""Coverage-guided fuzzing of one reader, by Atheris: `fuzz.py --reader=READER FOLDER... [options of libFuzzer]`."""

from __future__ import annotations

import sys

import atheris

# only what is ours or reads for us: every branch that counts costs time
with atheris.instrument_imports(include=["warmslip", "tomllib"]):
    from readers import READERS


def main() -> None:
    # libFuzzer passes over what begins with two dashes and hands it on to the processes of a merge, which start this file
    reader = READERS[next(word for word in sys.argv if word.startswith("--reader=")).removeprefix("--reader=")]

    def one(data: bytes) -> None:
        reader(data)

    atheris.Setup(sys.argv, one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
