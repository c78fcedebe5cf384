"""How long LinuxCNC's whole controller takes for a text, and how far what it executes is from the CL path.

    python tests/nc/controller_table.py [FOLDER]
    python tests/nc/controller_table.py --short

Prints one table: each path unsmoothed, and as the program writes it for LinuxCNC, at two tolerances. The axes of the
machine have the limits of `linuxcnc_controller.STATED`, the feed is 1800 mm/min; time is counted in servo cycles, so
that the load of this computer does not matter. FOLDER holds the real CL files of the tests; without it the sample alone
is run; `--short` runs a few poses of it at one tolerance against one unsmoothed text.
Exit code 0 where long lines keep the tolerance in what is executed, and are nowhere slower than the fastest unsmoothed
text that does, whatever blend it gives.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from cornersmooth.cl import read
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Move, Program
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.nc.form import ROTARY_SHARE
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from nc.linuxcnc_controller import MACHINE, SERVO_SECONDS, STATED, Floats, deviations, original, run_controller, tool

SAMPLE = Path(__file__).parents[2] / "samples" / "impeller.cls"
#: files of the folder, and how many of their poses are run
FILES = (("hecc_point_zigzag.csv", 120), ("hust_5x_impeller_yelun.cls", 52))
#: one pass of the sample, between two rapids
FIRST, LAST = 4, 80
#: a part of that, and the part of the tolerance that an unsmoothed text of it gives G64
SHORT, SHORT_BLEND = (4, 30), 0.9
FEED, AXIS_LENGTH = 1800.0, 10.0
#: mm
TOLERANCES = (0.01, 0.04)
#: parts of the tolerance that the unsmoothed program tells G64: the largest that keeps it is looked for
BLENDS = (0.1, 0.15, 0.2, 0.3, 0.45, 0.65, 0.9)
#: part of the tolerance by which rotary axes may leave the tool axis between two points of an unsmoothed program: as
#: far as they like, and so far that points have to be put in
LOOSE, CLOSE = 5.0, 0.3


@dataclass(frozen=True)
class Executed:
    """What the controller did."""

    word: str
    seconds: float
    tip: float
    axis_point: float
    jerk: float

    @property
    def deviation(self) -> float:
        """Larger one of tip and axis point, mm."""
        return max(self.tip, self.axis_point)


def paths(folder: Path | None) -> dict[str, Program]:
    """Programs of feed moves only, all with one feed."""
    sample = read(SAMPLE.read_bytes(), name=SAMPLE.name)
    found = {SAMPLE.name: _feeding(sample, FIRST, LAST)}
    for name, count in FILES if folder else ():
        program = read((folder / name).read_bytes(), name=name)
        found[name] = _feeding(program, 0, count)
    return found


def _feeding(program: Program, first: int, last: int) -> Program:
    part = slice(first, last)
    assert (program.kind[part][1:] == Move.LINEAR).all()
    return Program.from_poses(program.tip[part], program.axis[part], feed=FEED, source=program.source)


def unsmoothed(program: Program, blend: float, turn: float) -> bytes:
    """The poses themselves in rotary words, with points between that keep the axis point within `turn`, mm."""
    kept = replace(program, keep=np.ones(len(program), np.uint8))
    tolerance = turn / ROTARY_SHARE
    return _text(kept, Settings(tolerance=tolerance, lines="dense", blend_share=blend / tolerance))


def rivals(program: Program, tolerance: float) -> Iterator[tuple[str, bytes, Executed]]:
    """Unsmoothed programs, with their names and what became of them, each with larger blends while it keeps ε."""
    for how, part in (("", LOOSE), (" with points", CLOSE)):
        low, high = -1, len(BLENDS)  # kept, and not
        while high - low > 1:
            middle = (low + high) // 2
            blend = BLENDS[middle] * tolerance
            text = unsmoothed(program, blend, part * tolerance)
            did = execute(program, text)
            yield f"unsmoothed{how}, G64 P{blend:g}", text, did
            low, high = (middle, high) if did.deviation <= tolerance else (low, middle)


def ours(program: Program, tolerance: float, lines: str) -> bytes:
    """What the program writes."""
    return _text(program, Settings(tolerance=tolerance, axis_length=AXIS_LENGTH, lines=lines))


def own_texts(program: Program, tolerance: float) -> Iterator[tuple[str, bytes, Executed]]:
    """What the program writes, with names and what became of it."""
    for lines in ("dense", "long"):
        text = ours(program, tolerance, lines)
        yield f"--lines {lines}", text, execute(program, text)


def _text(program: Program, settings: Settings) -> bytes:
    form = choose_form("linuxcnc", machine=load_machine(MACHINE))
    stream = io.BytesIO()
    write(smooth(program, fit_settings(settings, form, program.units)), stream, form=form)
    return stream.getvalue()


def execute(program: Program, text: bytes) -> Executed:
    """Run the text and measure what the axes did from the first pose on."""
    word, joints, _ = run_controller(text, 900.0, STATED)
    if not len(joints):
        return Executed(word, np.nan, np.nan, np.nan, np.nan)
    tip, axis = tool(joints)
    poses = np.concatenate((tip, tip + AXIS_LENGTH * axis), axis=1)
    cuts = original(program, AXIS_LENGTH)
    begin = _arrival(poses, cuts[0][0])
    tip_error, axis_error = deviations(poses[begin:], cuts)
    jerk = np.diff(joints[begin:, 3:], n=3, axis=0) / SERVO_SECONDS**3
    seconds = (len(joints) - begin) * SERVO_SECONDS
    return Executed(word, seconds, tip_error, axis_error, float(np.sqrt((jerk**2).mean())))


def _arrival(poses: Floats, start: Floats) -> int:
    """First sample that is as near to the start as it gets: the tool comes from elsewhere with the same feed."""
    away = np.linalg.norm(poses - start, axis=1)
    near = int(np.argmax(away < 0.1))
    return near + int(np.argmin(away[near : near + 400]))


def short() -> int:
    """Run a few poses, as we write them and unsmoothed; 0 where ours keep the tolerance in less time, 2 for no run."""
    sample = read(SAMPLE.read_bytes(), name=SAMPLE.name)
    program, tolerance = _feeding(sample, *SHORT), TOLERANCES[-1]
    theirs = execute(program, unsmoothed(program, SHORT_BLEND * tolerance, LOOSE * tolerance))
    own = execute(program, ours(program, tolerance, "long"))
    for name, did in (("unsmoothed", theirs), ("ours", own)):
        print(f"{name}: {did.word}; {did.seconds:.2f} s, tip {did.tip:.4f} mm, axis point {did.axis_point:.4f} mm")
    if not theirs.word == own.word == "done":
        return 2
    return 0 if own.deviation <= tolerance and theirs.deviation <= tolerance and own.seconds < theirs.seconds else 1


def main(arguments: list[str]) -> int:
    """Print the table."""
    if arguments == ["--short"]:
        return short()
    print("| path | tolerance | text | blocks | time s | tip mm | axis point mm | rms jerk of rotary axes deg/s3 |")
    print("|---|---|---|---|---|---|---|---|")
    good = True
    for name, program in paths(Path(arguments[0]) if arguments else None).items():
        for tolerance in TOLERANCES:
            kept: dict[str, float] = {}
            for label, text, did in chain(rivals(program, tolerance), own_texts(program, tolerance)):
                good &= did.word == "done"
                numbers = f"{did.seconds:.2f} | {did.tip:.4f} | {did.axis_point:.4f} | {did.jerk:.0f}"
                print(f"| {name} | {tolerance:g} | {label} | {len(text.splitlines())} | {numbers} |", flush=True)
                if did.deviation <= tolerance:
                    kept[label] = did.seconds
            own = kept.pop("--lines long", np.inf)
            best = min((kept[label] for label in kept if label.startswith("unsmoothed")), default=np.inf)
            good &= own <= best and np.isfinite(own)
            share = f"{own / best:.2f} of the fastest unsmoothed text" if best < np.inf else "no unsmoothed text does"
            print(f"| {name} | {tolerance:g} | long lines: {share} | | | | | |", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
