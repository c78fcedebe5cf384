"""Random 3+2 programs, by seed: several tools at several tilted faces, in tilted planes of the control.

``python -m verify.plane_programs FIRST LAST`` in the folder of the tests writes and judges them, and prints the seeds
of texts that are refused.
"""

from __future__ import annotations

import io
import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cornersmooth.errors import CornersmoothError, SettingsError
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import Form, Frame, choose_form, load_control
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from nc.cases import without_limits
from oracle.motion import unit

Floats = NDArray[np.float64]

#: controls with planes, and machines of theirs
FORMS = [
    *(("fanuc", machine, True) for machine in ("", "table-ac", "head-ac")),
    *(("mitsubishi", machine, True) for machine in ("", "table-ac")),
    *(("siemens", machine, True) for machine in ("", "table-bc", "nutated-bc", "head-table-bc")),
    *(("heidenhain", machine, True) for machine in ("", "head-ac", "table-ac")),
    *(("haas", machine, True) for machine in ("table-bc", "table-ac")),
    *((control, "table-bc", False) for control in ("fanuc", "siemens", "haas")),
]

BETWEEN = ("PPRINT/MARK", "$$ MARK", "COOLNT/ON", "COOLNT/OFF", "OPSTOP", "DELAY/0.5", "SPINDL/1500,RPM,CLW")


@dataclass(frozen=True)
class PlaneTrial:
    """A program and what is done with it."""

    seed: int
    form: Form
    settings: Settings
    frame: Frame
    cl: str

    def __str__(self) -> str:
        machine = self.form.machine.name if self.form.machine is not None else "vectors"
        s = self.settings
        return (
            f"seed {self.seed}: {self.form.control} {machine} {self.form.orientation} eps {s.tolerance:g} "
            f"H {s.axis_length:g} {self.frame.cycles} {s.lines} lines"
        )


class _Text:
    def __init__(self, rng: np.random.Generator, scale: float) -> None:
        self.rng, self.scale, self.lines = rng, scale, [f"UNITS/{'MM' if scale == 1.0 else 'INCHES'}"]

    def say(self, *lines: str) -> None:
        self.lines += lines

    def goto(self, tip: Floats, axis: Floats, *, rapid: bool = False) -> None:
        numbers = [f"{value:.7f}" for value in (*(tip / self.scale), *axis)]
        self.say(*(["RAPID"] if rapid else []), "GOTO/" + ",".join(numbers))

    def length(self, low: float, high: float) -> str:
        return f"{self.rng.uniform(low, high) / self.scale:.4f}"

    def sometimes(self) -> None:
        if self.rng.random() < 0.3:
            self.say(str(self.rng.choice(BETWEEN)))


def _cut(text: _Text, place: Floats, frame: Floats) -> None:
    """Lines in the plane and across it, the tool along its normal."""
    rng, axis = text.rng, frame[2]
    text.goto(place + 40 * axis, axis, rapid=True)
    text.say(f"FEDRAT/{text.length(100, 3000)},{'MMPM' if text.scale == 1.0 else 'IPM'}")
    for step in rng.normal(size=(int(rng.integers(1, 7)), 3)) * 10.0 ** rng.uniform(-1, 1.3):
        text.goto(place, axis)
        place = place + step @ frame
        if rng.random() < 0.1:
            text.sometimes()
    text.goto(place, axis)


def _arcs(text: _Text, place: Floats, frame: Floats) -> None:
    """Arcs and lines about the normal of the plane, or about one of its other axes."""
    rng, axis = text.rng, frame[2]
    text.goto(place + 40 * axis, axis, rapid=True)
    text.say(f"FEDRAT/{text.length(100, 3000)},{'MMPM' if text.scale == 1.0 else 'IPM'}")
    text.goto(place, axis)
    here = np.round(place / text.scale, 7)
    for _ in range(int(rng.integers(1, 4))):
        one, other = frame[0], frame[1]
        radius, begin = rng.uniform(1, 30) / text.scale, rng.uniform(0, 2 * np.pi)
        sweep = float(rng.choice([0.3, 1.2, np.pi / 2, 3.0, 4.5]))
        centre = np.round(here - radius * (np.cos(begin) * one + np.sin(begin) * other), 7)
        arm = here - centre
        radius = float(np.linalg.norm(arm - (arm @ axis) * axis))
        begin = float(np.arctan2(arm @ other, arm @ one))
        end = centre + radius * (np.cos(begin + sweep) * one + np.sin(begin + sweep) * other)
        text.say("CIRCLE/" + ",".join(f"{value:.7f}" for value in (*centre, *axis, radius)))
        text.goto(end * text.scale, axis)
        here = np.round(end, 7)
        if rng.random() < 0.5:
            here = np.round(here + (rng.normal(size=3) * [5, 5, 0] / text.scale) @ frame, 7)
            text.goto(here * text.scale, axis)


def _holes(text: _Text, place: Floats, frame: Floats) -> None:
    rng, axis = text.rng, frame[2]
    if rng.random() < 0.8:
        text.goto(place + 30 * axis, axis, rapid=True)
    per = "MMPM" if text.scale == 1.0 else "IPM"
    at = place + (rng.uniform(-30, 30, (int(rng.integers(1, 5)), 3)) * [1, 1, 0.1]) @ frame
    words = [str(word) for word in rng.choice(["DRILL", "DEEP", "BORE", "FACE", "BRKCHP"], int(rng.integers(1, 3)))]
    for word in words if rng.random() < 0.8 else ["TAP"]:
        if word == "TAP" and rng.random() < 0.5:
            text.say("SPINDL/700,RPM,CLW")
        peck = f",STEP,{text.length(2, 6)}" if word in ("DEEP", "BRKCHP") else ""
        dwell = ",DWELL,0.5" if word != "TAP" and rng.random() < 0.2 else ""
        back = f",RTRCTO,{text.length(15, 25)}" if rng.random() < 0.7 else ""
        feed = f"{per},{text.length(50, 400)}"
        text.say(f"CYCLE/{word},FEDTO,{text.length(4, 20)}{peck},{feed},RAPTO,{text.length(2, 5)}{back}{dwell}")
        for tip in at:
            text.goto(tip, axis)
    text.say("CYCLE/OFF")


def _turning(text: _Text, place: Floats, frame: Floats) -> None:
    """A cut in which the tool turns away, in five axes."""
    rng, axis = text.rng, frame[2]
    text.goto(place + 40 * axis, axis, rapid=True)
    text.say(f"FEDRAT/{text.length(100, 3000)},{'MMPM' if text.scale == 1.0 else 'IPM'}")
    for k in range(int(rng.integers(2, 6))):
        text.goto(place + 4.0 * k * frame[0], unit(axis + 0.02 * k * frame[1]))


def trial(seed: int) -> PlaneTrial:
    """Program of a seed with a control, machine and settings at random; the same each time."""
    rng = np.random.default_rng((seed, 9))
    control, name, tcp = FORMS[int(rng.integers(len(FORMS)))]
    machine = without_limits(load_machine(name)) if name else None
    text = _Text(rng, 25.4 if rng.random() < 0.2 else 1.0)
    faces = [np.eye(3)]
    for _ in range(int(rng.integers(1, 4))):
        axis = unit(rng.normal(size=3) * [1, 1, 0.4] + [0, 0, rng.uniform(0.2, 2.0)])
        axis[2] = abs(axis[2])  # a nutated head does not look up
        if rng.random() < 0.3:
            axis = np.round(axis * 5) / 5
        axis = np.round(unit(axis), 7)
        one = unit(np.cross([0.3, -0.2, 0.9], axis))
        faces.append(np.stack((one, np.cross(axis, one), axis)))
    heads = machine is not None and machine.swings_the_tool and not tcp
    for tool in range(1 if heads else int(rng.integers(1, 4))):
        text.say(f"LOADTL/{tool + 1}", "SPINDL/2000,RPM,CLW")
        for _ in range(int(rng.integers(1, 4))):
            frame = faces[int(rng.integers(len(faces)))]
            place = rng.uniform(-150, 150, 3)
            kinds = [_cut, _cut, _arcs, _holes, _holes, _turning]
            kinds[int(rng.integers(len(kinds)))](text, place, frame)
            if rng.random() < 0.7:
                text.goto(place + 60 * frame[2], frame[2], rapid=True)
            if rng.random() < 0.1 and frame[2, 2] < 1.0:
                text.say("GOHOME")
            text.sometimes()
    text.say("SPINDL/OFF", "FINI")
    tolerance, length = float(np.round(10.0 ** rng.uniform(-2.5, -0.5), 5)), float(rng.choice([5.0, 10.0, 50.0, 120.0]))
    settings = Settings(tolerance=tolerance, axis_length=length)
    most = load_control(control).digits.most
    digits = str(rng.choice(["", "", *map(str, range(3, most + 1))]))
    form = choose_form(control, "g1", machine=machine, tcp=tcp, digits=digits, planes=True)
    if form.long_lines and rng.random() < 0.3:
        settings = settings.but(lines="long")
    cycles = str(rng.choice(["native", "native", "moves"]))
    approach = float(rng.choice([0.0, 0.0, 15.0]))
    retract = float(rng.choice([0.0, 0.0, 20.0]))
    modal = bool(rng.random() < 0.3)
    frame_ = Frame(cycles=cycles, skip_cycles=True, approach=approach, retract=retract, modal=modal)
    return PlaneTrial(seed, form, settings, frame_, "\n".join(text.lines) + "\n")


def judged(of: PlaneTrial) -> tuple[str, dict[str, int]]:
    """What is wrong with the text of a trial, empty for nothing, and what was said of it."""
    stream = io.BytesIO()
    try:
        result = postprocess(of.cl.encode(), stream, of.settings, form=of.form, frame=of.frame, processes=1)
    except SettingsError as error:
        return f"settings: {error}", {}
    except CornersmoothError as error:
        found = getattr(error, "result", None)
        wrong = [] if found is None or found.verification is None else found.verification.problems
        return f"{error}; " + "; ".join(f"{one.code} NC {one.nc_line} {one.text}" for one in wrong[:3]), {}
    said = {finding.code: finding.count for finding in result.findings}
    return result.unverified, said


def main(first: int, last: int) -> None:
    """Judge the seeds from one to another."""
    planes = runs = wrong = 0
    for seed in range(first, last):
        of = trial(seed)
        text, said = judged(of)
        runs += 1
        planes += said.get("CS356", 0)
        if text:
            wrong += 1
            print(f"{of}: {text}", flush=True)
    print(f"{runs} programs, {planes} runs in planes, {wrong} refused")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
