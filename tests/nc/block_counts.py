"""Blocks of CL files in forms beside those of lines: ``python -m nc.block_counts [FOLDER]``, by hand.

Arcs must not become many blocks where the control runs them. All files of the tests and samples, and those of a folder
or of CORNERSMOOTH_CORPUS. Lists the blocks of each in `FORMS`, and how many times those of lines they are at most.
"""

from __future__ import annotations

import argparse
import io
import sys
from pathlib import Path

from cornersmooth import smooth
from cornersmooth.cl import read
from cornersmooth.errors import CornersmoothError
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import Frame, choose_form, write
from cornersmooth.settings import Settings
from nc.cases import without_limits
from oracle.files import OWN, SAMPLES, corpus_folder

#: control, form and machine; the first is what the others are compared with
FORMS = ("fanuc g1", "fanuc g6.2", "linuxcnc g1 xyzac-trt", "fanuc g1 table-ac")

#: a file must not grow more
MOST = 2.5


def blocks_of(path: Path, name: str, tolerance: float) -> int | str:
    """Blocks of a CL file in a form, or the code of what is refused."""
    control, form, *machine = name.split()
    try:
        program = read(path.read_bytes(), name=path.name)
        found = without_limits(load_machine(machine[0])) if machine else None
        chosen = choose_form(control, form, machine=found)
        smoothed = smooth(program, Settings(tolerance=tolerance), form=chosen)
        return write(smoothed, io.BytesIO(), form=chosen, frame=Frame(skip_cycles=True)).blocks
    except CornersmoothError as refusal:
        return refusal.code


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=corpus_folder())
    parser.add_argument("--tolerance", type=float, default=0.02)
    parser.add_argument("--forms", nargs="+", default=FORMS)
    given = parser.parse_args()
    files = sorted({*OWN.iterdir(), *SAMPLES.glob("*.cls"), *SAMPLES.glob("*.csv"), *SAMPLES.glob("*.aptsource")})
    if given.folder is not None:
        files += sorted(path for path in given.folder.iterdir() if path.is_file() and path.suffix != ".md")
    grown = 0
    print("".join(f"{name:>24}" for name in ("file", *given.forms, "times")))
    for path in files:
        counts = [blocks_of(path, name, given.tolerance) for name in given.forms]
        known = [count for count in counts if isinstance(count, int)]
        times = max(known) / known[0] if known else 0.0
        grown += times > MOST
        print(f"{path.name[:23]:>24}" + "".join(f"{count:>24}" for count in counts) + f"{times:>24.2f}")
    print(f"{grown} of {len(files)} files grow more than {MOST} times")
    return int(grown > 0)


if __name__ == "__main__":
    sys.exit(main())
