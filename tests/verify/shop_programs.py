"""Random programs for machines with limited rotary axes, with one or none, with home and tool-change positions.

    cd tests; python -m verify.shop_programs 0 300

Cuts go round farther than an axis turns and are left on the way (`--rewind`), tools have holes and changes between.
Every text must pass verification, or be refused for a reason; words of rotary axes must be within their limits.
With `options` as the third word each program is also written with options at random: digits, repeated words left out,
tilted planes, ways along the tool beside retracts, block numbers, work offsets, inches, functions of the control.
With `forms` it is written in a form with curves, or for the neutral control.
"""

from __future__ import annotations

import io
import re
import sys
from collections import Counter
from dataclasses import dataclass, field, replace

import numpy as np

from cornersmooth.errors import CornersmoothError, SettingsError
from cornersmooth.kinematics import Machine, parse_machine
from cornersmooth.nc import Form, Frame, choose_form, load_control
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings

CONTROLS = ("fanuc", "mitsubishi", "haas", "siemens", "heidenhain", "linuxcnc")

#: what `forms` draws
FORMS = (
    ("generic", "g1"),
    ("generic", "g1"),
    ("generic", "g6.2"),
    ("fanuc", "g6.2"),
    ("siemens", "bspline"),
    ("heidenhain", "spl"),
)

#: what comes of texts
OUTCOMES = ("passed", "refused", "FALSE ALARM", "BEYOND LIMITS")


@dataclass(frozen=True)
class ShopTrial:
    """A program and what it is written for."""

    seed: int
    machine: Machine
    control: str
    tcp: bool
    rewind: float
    settings: Settings
    cl: str
    native: bool
    frame: Frame = field(default_factory=Frame)
    digits: str = ""
    planes: bool = False
    extras: tuple[str, ...] = ()
    form_name: str | None = None

    def __str__(self) -> str:
        s, kind = self.settings, self.machine.kind or "three axes"
        form = f"{self.control} {self.form_name}" if self.form_name else self.control
        return (
            f"seed {self.seed}: {form} {kind}{'' if self.tcp else ' no tcp'} rewind {self.rewind:g} "
            f"eps {s.tolerance:g} H {s.axis_length:g} {s.method} {s.lines}{self._options()}"
        )

    def _options(self) -> str:
        usual = Frame()
        said = {name: value for name, value in vars(self.frame).items() if value != getattr(usual, name)}
        more = {"digits": self.digits, "planes": self.planes, "extras": self.extras}
        said |= {name: value for name, value in more.items() if value}
        return "".join(f" {name}={value}" for name, value in said.items()) + " inch" * self.cl.startswith("UNITS/INCH")

    def form(self) -> Form:
        """Form that the text is written in."""
        return choose_form(
            self.control,
            self.form_name,
            machine=self.machine,
            tcp=self.tcp,
            rewind=self.rewind,
            digits=self.digits,
            planes=self.planes,
            extras=self.extras,
        )


def _machine(rng: np.random.Generator, axes: int, limit: float) -> Machine:
    """Machine with so many rotary axes; the first of them turns by `limit` degrees either way."""
    first, second = ("A", [1, 0, 0]), ("C", [0, 0, 1])
    carrier = str(rng.choice(["table", "head"]))

    def axis(name: str, direction: list[int], carrier: str, **more: object) -> dict[str, object]:
        point = np.round(rng.uniform(-80, 80, 3), 3).tolist()
        return {"name": name, "direction": direction, "carrier": carrier, "point": point, **more}

    limits = {"limits": [-limit, limit]} if limit else {}
    table: dict[str, object] = {"tool_length": float(rng.integers(0, 200)), "axis": []}
    if axes == 1:
        table["axis"] = [axis(*first, carrier, **limits)]
    elif axes == 2:
        table["axis"] = [axis(*second, "table", **limits), axis(*first, carrier)]
    for key in ("home", "tool_change"):
        if rng.random() < 0.4:
            names = ["X", "Y", "Z", *(["A"] if axes else [])]
            table[key] = {name: float(np.round(rng.uniform(-90, 90), 2)) for name in names if rng.random() < 0.6}
    return parse_machine(table)


def _poses(rng: np.random.Generator, axes: int) -> tuple[np.ndarray, np.ndarray]:
    """Poses of a cut that such a machine reaches: round farther than a turn, or a random walk."""
    count = int(rng.integers(4, 60))
    turn = np.cumsum(rng.uniform(-3, 25, count) if rng.random() < 0.6 else rng.uniform(-20, 20, count))
    lean = np.zeros(count) + rng.uniform(10, 60) if axes == 2 else turn
    around = np.radians(turn if axes == 2 else np.full(count, -90.0))
    sine, cosine = np.sin(np.radians(lean)), np.cos(np.radians(lean))
    axis = np.stack((sine * np.cos(around), sine * np.sin(around), cosine), axis=1)
    if axes == 0:
        axis = np.tile([0.0, 0.0, 1.0], (count, 1))
    tip = np.cumsum(rng.normal(size=(count, 3)) * rng.choice([0.1, 2.0, 8.0]), axis=0) + 10 * axis
    return np.round(tip, 4), axis


def _program(rng: np.random.Generator, axes: int, *, tools: bool) -> str:
    lines = ["UNITS/MM"]
    for number in range(int(rng.integers(1, 4))):
        if tools or not number:
            lines += [f"LOADTL/{number + 1}", f"SPINDL/{int(rng.integers(500, 9000))},RPM,CLW"]
        for _ in range(int(rng.integers(1, 3))):
            tip, axis = _poses(rng, axes)
            rows = [
                ",".join([*(f"{v:.4f}" for v in p), *(f"{v:.7f}" for v in k)]) for p, k in zip(tip, axis, strict=True)
            ]
            above = tip[0] + 60 * axis[0]
            start = ",".join([*(f"{v:.4f}" for v in above), *(f"{v:.7f}" for v in axis[0])])
            lines += ["RAPID", f"GOTO/{start}", f"FEDRAT/{int(rng.integers(50, 3000))},MMPM"]
            for row in rows:
                lines.append(f"GOTO/{row}")
                if rng.random() < 0.03:
                    lines.append(str(rng.choice(["COOLNT/ON", "DELAY/0.5", "PPRINT/MARK", "OPSTOP"])))
            back = tip[-1] + 70 * axis[-1]
            lines += ["RAPID", "GOTO/" + ",".join([*(f"{v:.4f}" for v in back), *(f"{v:.7f}" for v in axis[-1])])]
        if rng.random() < 0.4:
            lines += ["RAPID", "GOTO/0,0,60,0,0,1", "CYCLE/DRILL,FEDTO,9,MMPM,200,RAPTO,3,RTRCTO,25"]
            lines += [f"GOTO/{x:.3f},{y:.3f},0,0,0,1" for x, y in rng.uniform(-40, 40, (3, 2)).tolist()]
            lines += ["CYCLE/OFF", "RAPID", "GOTO/0,0,80,0,0,1"]
    return "\n".join([*lines, "SPINDL/OFF", "FINI", ""])


def shop_trial(seed: int) -> ShopTrial:
    """Program of a seed; the same each time."""
    rng = np.random.default_rng((seed, 7))
    axes = int(rng.choice([0, 1, 1, 2, 2]))
    limit = float(rng.choice([0.0, 190.0, 200.0, 365.0])) if axes else 0.0
    machine = _machine(rng, axes, limit)
    control = str(rng.choice(CONTROLS))
    tcp = control == "heidenhain" or bool(rng.random() < 0.6)
    settings = Settings(
        tolerance=float(np.round(10.0 ** rng.uniform(-2.5, -0.5), 5)),
        axis_length=float(np.round(10.0 ** rng.uniform(0.3, 1.8), 2)),
        method=str(rng.choice(["proportional", "proportional", "zhang2016", "global"])),
    )
    if tcp and axes and rng.random() < 0.4 and settings.method != "zhang2016":
        settings = settings.but(lines=str(rng.choice(["long", "dense"])))
    tools = tcp or not machine.swings_the_tool
    rewind = float(rng.choice([5.0, 40.0])) if axes and rng.random() < 0.8 else 0.0
    return ShopTrial(
        seed, machine, control, tcp, rewind, settings, _program(rng, axes, tools=tools), bool(rng.random() < 0.4)
    )


def with_options(one: ShopTrial) -> ShopTrial:
    """Return the same program with options at random, the same each time."""
    rng = np.random.default_rng((one.seed, 8))
    table = load_control(one.control)
    offsets = [None, None, "", table.program.work_offset[:-1] + "5"]
    high = bool(table.program.retract)
    frame = Frame(
        modal=bool(rng.random() < 0.5),
        approach=high * float(rng.choice([0.0, 0.0, 15.0])),
        retract=high * float(rng.choice([0.0, 0.0, 20.0])),
        block_numbers=bool(rng.random() < 0.3),
        comments=bool(rng.random() < 0.8),
        header=("(MINE {units})",) if rng.random() < 0.2 and table.layout.comment[0] == "(" else (),
        work_offset=offsets[int(rng.integers(len(offsets)))],
        skip_cycles=True,
    )
    digits = str(rng.choice(["", *map(str, range(3, table.digits.most + 1)), *table.systems]))
    two = len(one.machine.names) == 2
    planes = table.forms["g1"].plane is not None and two and bool(rng.random() < 0.6)
    planes = planes and not (one.control == "haas" and one.machine.swings_the_tool)
    cl = one.cl
    if rng.random() < 0.3:
        cl = re.sub(
            r"MMPM,(\d+),RAPTO,3,RTRCTO,25", r"IPM,\1,RAPTO,3,RTRCTO,25", cl.replace("UNITS/MM", "UNITS/INCHES")
        )
        cl = cl.replace(",MMPM", ",IPM")
    if rng.random() < 0.4:  # holes of other kinds, in a tilted plane where there is one
        cl = cl.replace("CYCLE/DRILL,FEDTO,9", str(rng.choice(["CYCLE/DEEP,STEP,4,FEDTO,9", "CYCLE/BORE,FEDTO,9"])))
    extras = [name for name, extra in table.extras.items() if not extra.forms or "g1" in extra.forms]
    chosen = tuple(str(name) for name in rng.permutation(extras)[: int(rng.integers(0, 2))])
    return replace(one, frame=frame, digits=digits, planes=planes, extras=chosen, cl=cl)


def with_forms(one: ShopTrial) -> ShopTrial:
    """Return the same program for another control or form at random, the same each time."""
    rng = np.random.default_rng((one.seed, 9))
    control, form = FORMS[int(rng.integers(len(FORMS) if len(one.machine.names) == 2 else 1))]
    method = one.settings.method if form == "g1" else one.settings.method.replace("zhang2016", "proportional")
    tcp = one.tcp or form != "g1"
    lines = one.settings.lines if form == "g1" and tcp else None
    rewind = 0.0 if control == "generic" else one.rewind
    settings = one.settings.but(lines=lines, method=method)
    return replace(one, control=control, form_name=form, tcp=tcp, rewind=rewind, settings=settings)


def outcome(one: ShopTrial) -> tuple[str, str, int]:
    """Outcome of a trial, what is to be said of it, and how many cuts are left."""
    stream, frame = io.BytesIO(), replace(one.frame, cycles="native" if one.native else "moves")
    try:
        result = postprocess(one.cl.encode(), stream, one.settings, form=one.form(), frame=frame, processes=1)
    except CornersmoothError as refusal:
        made = getattr(refusal, "result", None)
        if made is None:
            return "refused", str(refusal), 0
        wrong = [] if made.verification is None else made.verification.problems
        text = " | ".join(f"{one.nc_line}: {one.code} {one.text}" for one in wrong[:3])
        return "FALSE ALARM", text or str(refusal), 0
    except SettingsError as refusal:
        return "refused", str(refusal), 0
    text, found = stream.getvalue(), result.verification
    if found is None or result.unverified:
        return "FALSE ALARM", f"not verified: {result.unverified}", 0
    for axis in one.machine.axes:
        words = (
            [float(value) for value in re.findall(rf" {axis.name}([-+]?\d+\.\d*)", text.decode())] if axis.name else []
        )
        if axis.limits is not None and words and not axis.low <= min(words) <= max(words) <= axis.high:
            return "BEYOND LIMITS", f"{axis.name} from {min(words)} to {max(words)}", 0
    return "passed", "", len(found.rewinds)


def main() -> int:
    """Judge the programs of a range of seeds."""
    first, last = (int(word) for word in sys.argv[1:3])
    count: Counter[str] = Counter()
    rewinds = 0
    changed = {"options": with_options, "forms": with_forms}
    for seed in range(first, last):
        one = changed.get(" ".join(sys.argv[3:]), lambda one: one)(shop_trial(seed))
        word, why, left = outcome(one)
        count[word] += 1
        count[f"{len(one.machine.names)} rotary axes"] += 1
        rewinds += left
        if word != "passed":
            print(word, one, why, flush=True)
    print(", ".join(f"{number} {word}" for word, number in sorted(count.items())), f"{rewinds} cuts left")
    return int(bool(count["FALSE ALARM"] + count["BEYOND LIMITS"]))


if __name__ == "__main__":
    sys.exit(main())
