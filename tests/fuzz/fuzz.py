"""Coverage-guided fuzzing of one reader, by Atheris: `python fuzz.py READER FOLDER... [options of libFuzzer]`."""

from __future__ import annotations

import sys

import atheris

# only what is ours or reads for us: every branch that counts costs time
with atheris.instrument_imports(include=["warmslip", "tomllib"]):
    from readers import READERS, checkpoint, owner


def main() -> None:
    reader = READERS[sys.argv.pop(1)]
    checkpoint._owner = owner

    def one(data: bytes) -> None:
        reader(data)

    atheris.Setup(sys.argv, one)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
