"""Slices of CL files with their lines mixed up, through the whole command: done and verified, or refused with a reason.

    cd tests; python -m verify.slices 0 300 [FOLDER]...

Each number is a slice of one of our own files, or of those in the folders, with lines put in, left out, doubled,
exchanged, turned round or changed by a digit, written for a control, form, machine and method at random. What is
neither written and verified nor refused is printed: a promise that is broken, an output that cannot be written, or an
error of the program itself.
"""

from __future__ import annotations

import random
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from oracle.command import BAD_INPUT, DONE, USAGE, run
from oracle.files import OWN, SAMPLES

SUFFIXES = (".apt", ".aptsource", ".as", ".cldata", ".cls", ".csv", ".ncl", ".txt")

#: bytes of a file from which slices are taken, at most
LARGEST = 400_000

#: statements that are put in
STATEMENTS = """RAPID|FEDRAT/MMPM,300|FEDRAT/0.1,MMPR|SPINDL/RPM,3000,CLW|SPINDL/OFF|COOLNT/ON|COOLNT/OFF|LOADTL/5
DELAY/1.5|STOP|OPSTOP|GOHOME|CYCLE/OFF|CYCLE/DRILL,10,MMPM,200,3|MULTAX/OFF|MULTAX/ON|PPRINT/HALLO (x)|CUTCOM/OFF
AUXFUN/12|INSERT/G5.1|GODLTA/0,0,5|GODLTA/3|END|UNITS/INCHES|UNITS/MM|CIRCLE/1,2,3,0,0,1,5|FROM/0,0,100|TOOLNO/3,10"""

FORMS = {
    "fanuc": ("g1", "g6.2"),
    "siemens": ("g1", "bspline", "poly"),
    "heidenhain": ("g1", "spl"),
    "mitsubishi": ("g1", "g6.2"),
    "haas": ("g1",),
    "linuxcnc": ("g1",),
    "generic": ("g1", "g6.2"),
}
MACHINES = ("table-ac", "table-bc", "head-ac", "nutated-bc", "xyzac-trt")

#: exit codes of what is right
RIGHT = (DONE, USAGE, BAD_INPUT)


@dataclass(frozen=True)
class Slice:
    """Lines of a CL file, and how they are written."""

    lines: list[str]
    suffix: str
    options: list[str]


def files_of(folders: Sequence[Path]) -> list[Path]:
    """Our own files and those of folders, from which slices are taken."""
    found = [path for folder in (OWN, SAMPLES, *folders) for path in sorted(folder.iterdir())]
    return [path for path in found if path.suffix in SUFFIXES and path.stat().st_size < LARGEST]


def draw(number: int, files: Sequence[Path]) -> Slice:
    """The slice of a number."""
    draws = random.Random(number)
    path = draws.choice(files)
    lines = path.read_text(errors="replace").splitlines()
    count = draws.choice([20, 60, 200, 500])
    first = draws.randrange(max(1, len(lines) - count))
    head = lines[: draws.choice([0, 10, 30])] if first > 30 else []
    lines = head + lines[first : first + count]
    for _ in range(draws.choice([0, 0, 1, 3, 10])):
        if lines:
            _mix_up(lines, draws)
    return Slice(lines, path.suffix, _options(draws))


def _mix_up(lines: list[str], draws: random.Random) -> None:
    """Change lines in place, in one of six ways."""
    k, way = draws.randrange(len(lines)), draws.randrange(6)
    if way == 0:
        lines.insert(k, draws.choice(STATEMENTS.replace("\n", "|").split("|")))
    elif way == 1:
        del lines[k]
    elif way == 2:
        lines.insert(k, lines[k])
    elif way == 3:
        other = draws.randrange(len(lines))
        lines[k], lines[other] = lines[other], lines[k]
    elif way == 4 and (digits := [at for at, letter in enumerate(lines[k]) if letter.isdigit()]):
        at = draws.choice(digits)
        lines[k] = lines[k][:at] + draws.choice("0123456789.-") + lines[k][at + 1 :]
    else:
        lines[k:k] = lines[k : k + draws.randrange(20)][::-1]


def _options(draws: random.Random) -> list[str]:
    """Options of `smooth` at random."""
    control = draws.choice(list(FORMS))
    form, machine = draws.choice(FORMS[control]), draws.choice((*MACHINES, *[""] * len(MACHINES)))
    if control in ("haas", "linuxcnc"):
        machine = machine or draws.choice(MACHINES)
    options = ["--control", control, "--form", form]
    options += ["-e", draws.choice(["0.001", "0.01", "0.04", "0.2"]), "-H", draws.choice(["5", "10", "50"])]
    options += ["--method", draws.choice(["proportional", "proportional", "global", "zhang2016"])]
    options += ["--machine", machine] if machine else []
    if machine and control != "generic":
        options += draws.choice([[], [], [], ["--no-tcp"]]) + draws.choice([[], ["--rewind", "20"]])
    if form == "g1" and control not in ("generic", "linuxcnc"):
        options += draws.choice([[], [], ["--planes", "tilted"]])
    options += draws.choice([[], ["--skip-cycles"]]) + draws.choice([[], [], ["--cycles", "native"]])
    return options + draws.choice([[], ["--feed", "500"]])


def outcome(one: Slice, folder: Path) -> tuple[int, str]:
    """Exit code of the command for a slice, and what it says."""
    source = folder / f"slice{one.suffix}"
    source.write_text("\n".join([*one.lines, ""]))
    done = run("smooth", source, "-o", folder / "slice.nc", "--force", "-q", *one.options)
    return done.returncode, done.stderr.decode("utf-8", "replace")


def main(first: int, last: int, folders: Sequence[Path]) -> int:
    """Run slices; return how many of them were neither written and verified nor refused."""
    files, counts, wrong = files_of(folders), Counter[int](), 0
    with tempfile.TemporaryDirectory() as name:
        for number in range(first, last):
            one = draw(number, files)
            code, said = outcome(one, Path(name))
            counts[code] += 1
            if code not in RIGHT or "internal error" in said:
                wrong += 1
                print(
                    f"WRONG {number}: exit code {code}, {' '.join(one.options)}", *said.splitlines()[:3], sep="\n    "
                )
    print(", ".join(f"exit code {code}: {count}" for code, count in sorted(counts.items())))
    return wrong


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]), int(sys.argv[2]), [Path(folder) for folder in sys.argv[3:]]) > 0)
