"""Hashes of many texts, to see whether a change of the writer changes any: ``python -m nc.all_texts FILE``, by hand.

All golden texts, all CL files in the forms of every control, with machines and without, and what these do not ask
for: cycles, planes, clamps, rewinds, positions of a machine, words that repeat. The first run writes the file; later
ones list what is different, findings too, and have exit code 1 then. ``--new`` writes the file anew.
"""

from __future__ import annotations

import argparse
import hashlib
import io
import json
import pickle
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from cornersmooth.cl import read
from cornersmooth.errors import CornersmoothError
from cornersmooth.kinematics import Machine, load_machine, parse_machine
from cornersmooth.model import SmoothProgram
from cornersmooth.nc import Form, Frame, choose_form, fit_settings, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from nc import test_nc_cut_rewinds as rewinds
from nc import test_nc_cycles as cycles
from nc import test_nc_modal as modal
from nc import test_nc_modulo as turning
from nc import test_nc_planes as planes
from nc import test_nc_positions as positions
from nc import test_nc_rewinds as retracts
from nc import test_nc_tool_lengths as lengths
from nc.cases import without_limits
from nc.test_nc_golden import AXIS_LENGTH, CHORD, GOLDEN, TEXTS, TOLERANCE
from oracle.files import OWN, SAMPLES, corpus_folder

STATED = Settings(tolerance=TOLERANCE, axis_length=AXIS_LENGTH, chord_tolerance=CHORD)
PLAIN = Frame(skip_cycles=True)

#: forms of controls that every file is written in, and those with a machine
VECTORS = ["fanuc g1", "fanuc g6.2", "siemens g1", "siemens bspline", "siemens poly", "heidenhain g1", "heidenhain spl",
           "mitsubishi g1"]  # fmt: skip
ANGLES = ["fanuc g1 table-ac", "siemens g1 head-ac", "heidenhain g1 table-bc", "haas g1 head-table-bc",
          "linuxcnc g1 xyzac-trt"]  # fmt: skip

CLAMPS = 'like = "{}"\n[[axis]]\nname = "B"\nclamp = ["M12", "M13"]\n[[axis]]\nname = "C"\nclamp = ["M10", "M11"]\n'
PLACES = 'like = "table-ac"\n[home]\nX = -200.0\nY = 150.5\nZ = -0.5\nA = 0.0\nC = 10.0\n' + (
    "[tool_change]\nX = 0.0\nY = 180.0\nZ = -25.0\n"
)

#: statements of many kinds, stops and dwells in cuts, arcs, compensation, feeds per revolution
WORDS = """PARTNO WORDS
UNITS/MM
PPRINT first (second)
TOOLNO/4,MILL
LOADTL/4,ADJUST,7
CUTTER/10,1,4
SPINDL/RPM,3000,CLW,RANGE,2
COOLNT/FLOOD
INSERT,'CALL 5'
RAPID
GOTO/0,0,50,0,0,1
GOTO/0,0,20
FEDRAT/MMPM,300
GOTO/0,0,0
CUTCOM/LEFT,XYPLAN
GOTO/20,0,0
CIRCLE/20,10,0,0,0,1,10
GOTO/30,10,0
GOTO/30,30,0
CUTCOM/OFF
GOTO/40,30,0
STOP
GOTO/50,30,0
DELAY/2
COOLNT/MIST
GOTO/60,30,0
FEDRAT/MMPR,0.2
GOTO/60,50,0
DELAY/3,REV
OPSTOP
AUXFUN/8
GOTO/60,60,5
SELECT/TOOL,5
SPINDL/3500,RPM,CCLW
GOTO/60,70,5
AUXFUN/77
SPINDL/ORIENT
FEDRAT/MMPM,250
GOTO/70,70,5
GOHOME
RAPID
GOTO/0,0,40
GOTO/0,0,5
FEDRAT/MMPM,200
GOTO/9,0,0,0.1,0,0.9949874
GOTO/20,0,0,0.2,0,0.9797959
FROM/-10,0,60
CIRCLE/0,0,60,0,0,1,10
GOTO/10,0,60
UNKNOWN/3
LOADTL/4,ADJUST,9
GOTO/10,0,60
GOTO/10,20,50
END
GOTO/10,30,50
LOADTL/5
SPINDL/OFF
FEDRAT/MMPM,100
GOTO/10,30,40
COOLNT/OFF
FINI
"""


#: cuts on opposite sides, with rapids between in which a tilted tool swings round
SIDES = "UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nFEDRAT/300,MMPM\n" + "".join(
    f"RAPID\nGOTO/{40 * x},{40 * y},30,{0.5 * x},{0.5 * y},0.8660254\nGOTO/{40 * x},{40 * y},0\n"
    f"GOTO/{30 * x},{35 * y},0\nRAPID\nGOTO/{40 * x},{40 * y},30\n"
    for x, y in ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 0), (0, -1))
) + "FINI\n"  # fmt: skip

#: the same for a control without compensation
WITHOUT = "\n".join(line for line in WORDS.splitlines() if not line.startswith("CUTCOM")) + "\n"


def _words(control: str) -> str:
    return WITHOUT if control == "heidenhain" else WORDS


def _long(poses: int = 9000) -> bytes:
    """More poses than are written at once: a zigzag with an axis that turns, a statement in the middle."""
    rows = [
        f"GOTO/{0.4 * (k % 150) * (-1) ** (k // 150 % 2) + 60 * (k // 150 % 2):.3f},{0.5 * (k // 150):.3f},"
        f"{np.sin(0.05 * k):.4f},{0.2 * np.sin(0.01 * k):.6f},0.1,{np.sqrt(0.99 - 0.04 * np.sin(0.01 * k) ** 2):.6f}\n"
        for k in range(poses)
    ]
    rows.insert(5000, "COOLNT/ON\n")
    head = "UNITS/MM\nLOADTL/1\nSPINDL/900,RPM,CLW\nRAPID\nGOTO/0,0,60,0,0.1,0.99498\nFEDRAT/400,MMPM\n"
    return "".join((head, *rows, "RAPID\nGOTO/0,0,60,0,0,1\nFINI\n")).encode()


@dataclass(frozen=True)
class Job:
    """A CL text, what it is written for, and how."""

    name: str
    cl: bytes
    form: Callable[[], Form]
    frame: Frame = PLAIN
    settings: Settings = STATED
    source: str = "part.cls"


def _form(control: str, machine: Machine | None = None, form: str = "g1", **how: Any) -> Callable[[], Form]:
    return lambda: choose_form(control, form, machine=machine, **how)


def _named(name: str, *, endless: bool = False) -> Callable[[], Form]:
    control, form, *machine = name.split()

    def choose() -> Form:
        found = load_machine(machine[0]) if machine else None
        return choose_form(control, form, machine=without_limits(found) if found is not None and endless else found)

    return choose


def jobs() -> Iterator[Job]:
    """All of them."""
    for source, case in TEXTS:
        yield Job(f"golden {source} {case}", (GOLDEN / f"{source}.cls").read_bytes(), case.choose, source=source)
    folder = corpus_folder()
    own = [*sorted(OWN.iterdir()), *sorted(GOLDEN.glob("*.cls")), *sorted(SAMPLES.glob("*.cls"))]
    real = (
        [] if folder is None else sorted(path for path in folder.iterdir() if path.is_file() and path.suffix != ".md")
    )
    for path in (*own, *real):
        for name in (*VECTORS, *ANGLES):
            yield Job(f"file {path.name} {name}", path.read_bytes(), _named(name, endless=True), source=path.name)
    yield from _features()


def _features() -> Iterator[Job]:
    native = replace(PLAIN, cycles="native")
    table_ac, table_bc = load_machine("table-ac"), load_machine("table-bc")
    along = replace(native, approach=15.0, retract=12.0)
    for case in cycles.CASES:
        for what, cl in (("plain", cycles.PLAIN), ("tilted", cycles.TILTED)):
            for how, frame in (("moves", PLAIN), ("native", native)):
                yield Job(f"cycles {what} {how} {case}", cl.encode(), case.choose, frame)
    for case in planes.CASES:
        machine = load_machine(case.machine) if case.machine else None
        form = _form(case.control, machine, tcp=case.tcp, planes=True)
        for how, frame in (("moves", PLAIN), ("native", native), ("along", along)):
            yield Job(f"planes {how} {case}", planes.CL.encode(), form, frame)
        for what, cl in (("modal", modal.CL), ("cycles", cycles.TILTED), ("words", _words(case.control))):
            yield Job(f"planes of {what} {case}", cl.encode(), form, native)
    for control in ("fanuc", "siemens", "heidenhain", "mitsubishi", "generic"):
        for what, cl in (("modal", modal.CL), ("words", _words(control)), ("cycles", cycles.TILTED)):
            frame = replace(native, modal=True, block_numbers=True)
            yield Job(f"modal {what} {control}", cl.encode(), _form(control), frame)
            if control != "generic":
                yield Job(f"along {what} {control}", cl.encode(), _form(control), along)
    for control in ("fanuc", "siemens", "heidenhain", "haas", "mitsubishi", "generic", "linuxcnc"):
        machine = load_machine("xyzac-trt") if control == "linuxcnc" else table_ac
        goes_up = control != "generic"
        for tcp in (True, False) if control != "heidenhain" else (True,):
            for what, cl in (("modal", modal.CL), ("words", _words(control)), ("cycles", cycles.TILTED)):
                form, frame = _form(control, machine, tcp=tcp), replace(native, modal=True)
                yield Job(f"angles {what} {control} {tcp}", cl.encode(), form, frame)
                if goes_up:
                    yield Job(f"angles along {what} {control} {tcp}", cl.encode(), form, along)
    for control, name, tcp in rewinds.CASES:
        form = _form(control, rewinds.short(name), tcp=tcp, rewind=25.0)
        for how, frame in (("", PLAIN), ("along", along), ("modal", replace(PLAIN, modal=True))):
            yield Job(f"rewinds {how} {control} {name} {tcp}", rewinds.program_text(), form, frame)
        form = _form(control, load_machine(name), tcp=tcp)
        yield Job(f"spiral {control} {name} {tcp}", turning.spiral().encode(), form)
        yield Job(f"sides {control} {name} {tcp}", SIDES.encode(), form)
        form = _form(control, retracts.short(name), tcp=tcp)
        for how, frame in (("", PLAIN), ("along", along)):
            yield Job(f"retracts {how} {control} {name} {tcp}", retracts.program_text(30.0), form, frame)
    for control in ("fanuc", "siemens", "haas"):
        clamped = parse_machine(CLAMPS.format("table-bc"))
        for what, cl in (("positions", positions.CL), ("cycles", cycles.TILTED), ("words", _words(control))):
            for tcp in (True, False):
                yield Job(f"clamps {what} {control} {tcp}", cl.encode(), _form(control, clamped, tcp=tcp), native)
        yield Job(f"clamps planes {control}", planes.CL.encode(), _form(control, clamped, planes=True), native)
    for control in ("fanuc", "siemens", "haas", "mitsubishi", "heidenhain"):
        form = _form(control, parse_machine(PLACES))
        for how, frame in (("", PLAIN), ("along", along)):
            yield Job(f"positions {how} {control}", positions.CL.encode(), form, frame)
        yield Job(f"modulo {control}", turning.spiral().encode(), _form(control, turning.modulo()))
    for control, like in (("fanuc", "head-ac"), ("siemens", "head-table-bc"), ("haas", "nutated-bc")):
        form = _form(control, lengths.machine(like=like), tcp=False)
        yield Job(f"lengths {control}", lengths.CL.encode(), form, along)
    for control, name, extra in (("fanuc", "g1", "aicc"), ("fanuc", "g1", "hpcc"), ("fanuc", "g6.2", "hpcc"),
                                 ("siemens", "g1", "cycle832"), ("heidenhain", "g1", "cycle32")):  # fmt: skip
        form = _form(control, form=name, extras=[extra])
        yield Job(f"extras {control} {name} {extra}", positions.CL.encode(), form)
    yield Job("extras haas", positions.CL.encode(), _form("haas", table_bc, extras=["g187"]))
    frame = replace(PLAIN, header=("G61 {units}",), footer=("M99 {blend}",), work_offset="G55", comments=False)
    frame = replace(frame, line_ends="crlf", program="O77", provenance=("made of",))
    yield Job("frame fanuc", positions.CL.encode(), _form("fanuc", table_ac), frame)
    yield Job("inch words", WITHOUT.replace("MM\n", "INCHES\n", 1).encode(), _form("heidenhain"))
    yield Job("retracts generic", retracts.program_text(30.0), _form("generic", retracts.short("table-ac")))
    for name in ("fanuc g1", "siemens bspline", "siemens poly", "fanuc g1 table-ac", "linuxcnc g1 xyzac-trt"):
        yield Job(f"long {name}", _long(), _named(name))
    for method in ("proportional", "zhang2016"):
        yield Job(f"{method} fanuc g6.2", (GOLDEN / "corner.cls").read_bytes(), _form("fanuc", form="g6.2"),
                  settings=STATED.but(method=method))  # fmt: skip
    for lines in ("long", "dense"):
        yield Job(f"{lines} linuxcnc", (GOLDEN / "corner.cls").read_bytes(),
                  _form("linuxcnc", load_machine("xyzac-trt")), settings=STATED.but(lines=lines))  # fmt: skip
        yield Job(f"{lines} fanuc", (SAMPLES / "impeller.cls").read_bytes(), _form("fanuc"),
                  settings=STATED.but(lines=lines))  # fmt: skip


def smoothed_of(job: Job, form: Form, cache: Path | None) -> SmoothProgram:
    """Smoothed program of a job; from the cache, where it is there."""
    place = None if cache is None else cache / (hashlib.sha256(job.name.encode()).hexdigest()[:24] + ".pickle")
    if place is not None and place.exists():
        found = pickle.loads(place.read_bytes())
        assert isinstance(found, SmoothProgram)
        return found
    program = read(job.cl, name=job.source)
    found = smooth(program, fit_settings(job.settings, form, program.units))
    if place is not None:
        place.write_bytes(pickle.dumps(found))
    return found


def result(job: Job, cache: Path | None = None, kept: Path | None = None) -> list[str]:
    """Hash of the text, or why there is none, and the findings of the writer."""
    stream = io.BytesIO()
    try:
        form = job.form()
        written = write(smoothed_of(job, form, cache), stream, form=form, frame=job.frame)
    except CornersmoothError as refusal:
        return [f"{refusal.code} {refusal}"]
    text = stream.getvalue()
    if kept is not None:
        (kept / (job.name.replace(" ", "_") + ".nc")).write_bytes(text)
    notes = [f"{one.code} {one.severity} {one.line} {one.count} {one.text}" for one in written.findings]
    return [hashlib.sha256(text).hexdigest()[:16], str(written.blocks), *notes]


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("file", type=Path)
    parser.add_argument("--new", action="store_true")
    parser.add_argument("--only", default="", help="jobs whose name holds this")
    parser.add_argument("--cache", type=Path, help="folder of smoothed programs")
    parser.add_argument("--keep", type=Path, help="folder for the texts")
    given = parser.parse_args()
    for folder in filter(None, (given.cache, given.keep)):
        folder.mkdir(parents=True, exist_ok=True)
    found = {job.name: result(job, given.cache, given.keep) for job in jobs() if given.only in job.name}
    if given.new or not given.file.exists():
        given.file.write_text(json.dumps(found, indent=0))
        print(f"{len(found)} texts, {sum(len(one) == 1 for one in found.values())} refused")
        return 0
    before = json.loads(given.file.read_text())
    different = 0
    for name, now in found.items():
        then = before.get(name, ["not there before"])
        if now != then:
            different += 1
            text = "" if now[:2] == then[:2] else "text, " if len(now) > 1 and len(then) > 1 else "refusal, "
            notes = sorted(set(now[2:] if len(now) > 1 else now) ^ set(then[2:] if len(then) > 1 else then))
            print(f"{name}: {text}{'; '.join(notes) or 'order of findings' * (text == '')}")
    print(f"{len(found) - different} of {len(found)} as before")
    return int(bool(different))


if __name__ == "__main__":
    sys.exit(main())
