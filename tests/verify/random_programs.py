"""Random CL programs with everything in them that made verification object, or fail to: by seed, as text.

Several tools, holes with one cycle or two, taps, statements between a cycle and the next tool, chains of every
character with flips, spirals, repeated poses, a feed at every pose, dwells and comments between.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cornersmooth.errors import SettingsError
from cornersmooth.nc import Form
from cornersmooth.settings import Settings
from nc.cases import RUNNABLE, Case
from nc.promise import tame, upright
from oracle.chains import AXIS_DECIMALS, KINDS, Chain, turned
from oracle.motion import unit

Floats = NDArray[np.float64]

#: between poses, said of no motion
BETWEEN = ("PPRINT/MARK", "$$ MARK", "INSERT/MARK", "REMARK MARK", "DISPLY/ON")
#: what acts on the machine between two poses
ACTING = ("COOLNT/ON", "COOLNT/OFF", "COOLNT/MIST", "OPSTOP", "STOP", "SPINDL/9000,RPM,CLW", "DELAY/0.5")
#: share of programs whose feeds are planned, if they are short: a plan may take seconds
PLANNED, PLANNED_LINES = 0.05, 25


@dataclass(frozen=True)
class Trial:
    """A program and what is done with it.

    `digits` as `Control.with_digits` takes them, empty for the control's own; `planned`: feeds are those of a plan;
    `native`: holes are the control's own cycles.
    """

    seed: int
    case: Case
    settings: Settings
    units: str
    cl: str
    parts: tuple[str, ...] = ()
    digits: str = ""
    planned: bool = False
    native: bool = False

    def __str__(self) -> str:
        s = self.settings
        said = [str(self.case), self.units, f"eps {s.tolerance:.4g}", f"H {s.axis_length:.4g}", s.method]
        said += [f"{s.lines} lines"] if s.lines else []
        said += [f"digits {self.digits}"] if self.digits else []
        said += ["planned feeds"] if self.planned else []
        said += ["native cycles"] if self.native else []
        said += [f"axis tolerance {s.axis_tolerance:g}"] if s.axis_tolerance is not None else []
        return f"seed {self.seed}: " + " ".join(said) + " [" + " ".join(self.parts) + "]"


@dataclass
class _Text:
    """CL text as it grows."""

    rng: np.random.Generator
    scale: float  #: mm per unit
    one_tool: bool = False  #: the length of the only one goes into every position
    lines: list[str] = field(default_factory=list)
    feed: float = math.nan

    def say(self, *lines: str) -> None:
        self.lines += lines

    def goto(self, tip: Floats, axis: Floats, *, decimals: int = 4) -> None:
        numbers = [f"{value:.{decimals}f}" for value in tip / self.scale] + [f"{value:.7f}" for value in axis]
        self.say("GOTO/" + ",".join(numbers))

    def rapid(self, tip: Floats, axis: Floats) -> None:
        self.say("RAPID")
        self.goto(tip, axis)

    def at_feed(self, feed: float) -> None:
        if feed != self.feed:
            self.feed = feed
            self.say(f"FEDRAT/{feed:.4f},{'MMPM' if self.scale == 1.0 else 'IPM'}")


# ---------------------------------------------------------------- chains


def _spiral(rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
    """Many near turns, so that the nearest point of the path is often one of another turn."""
    t = np.linspace(0, 2 * np.pi * rng.uniform(1, 5), n + 1)
    r = rng.uniform(2, 10) + t * rng.uniform(0.005, 0.2)
    tip = np.stack((r * np.cos(t), r * np.sin(t), t * rng.choice([0.0, 0.01, 0.1])), axis=1)
    tilt = rng.uniform(0, 0.5)
    return tip, unit(np.stack((tilt * np.cos(t), tilt * np.sin(t), np.ones(n + 1)), axis=1))


def _tiny_beside_long(rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
    size = 10.0 ** rng.choice([-3.5, -2.5, 0.0, 1.8], (n, 1))
    tip = np.cumsum(np.vstack((np.zeros((1, 3)), rng.normal(size=(n, 3)) * size)), axis=0)
    axis = [unit(rng.normal(size=3) + [0, 0, 2])]
    for step in np.radians(rng.exponential(4, n)):
        axis.append(turned(axis[-1], step, rng))
    return tip, np.array(axis)


def _repeated(rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
    """Poses twice and three times, exactly or by the last digit."""
    tip, axis = _tiny_beside_long(rng, max(2, n // 2))
    again = np.sort(rng.integers(0, len(tip), n + 1))
    shift = rng.choice([0.0, 0.0, 1e-4], (n + 1, 3))
    return tip[again] + shift, axis[again]


def _there_and_back(rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
    way = unit(rng.normal(size=3)) * rng.uniform(0.5, 20)
    axis = unit(rng.normal(size=3) + [0, 0, 2])
    return np.outer(np.arange(n + 1) % 2, way), np.tile(axis, (n + 1, 1))


def _flip(rng: np.random.Generator, n: int) -> tuple[Floats, Floats]:
    """The tool axis turns by nearly half a turn within one segment."""
    tip, axis = KINDS[0](rng, n)
    at = int(rng.integers(1, n + 1))
    angle = math.radians(rng.choice([120.0, 150.0, 160.0, 165.0, 170.0, 174.9]))  # beyond 175 it is refused
    axis = axis.copy()
    axis[at:] = turned(axis[at - 1], angle, rng)
    return tip, axis


CHAINS = {
    "spiral": _spiral,
    "tiny": _tiny_beside_long,
    "repeated": _repeated,
    "back": _there_and_back,
    **{kind.__name__.strip("_"): kind for kind in KINDS},
}


def _chain(text: _Text, case: Case, fixed: bool, kind: str) -> None:
    rng = text.rng
    tip, axis = (_flip if kind == "flip" else CHAINS[kind])(rng, int(rng.integers(3, 16)))
    tip = np.round(tip - tip[0] + np.round(rng.uniform(-50, 50, 3), 3), 5)
    chain = Chain(tip, np.round(axis, AXIS_DECIMALS), np.ones(len(tip)))
    if fixed:
        chain = upright(chain)
    elif kind != "flip":
        chain = tame(chain, case.machine)
    dense_feeds, talk, dwell = rng.random() < 0.3, rng.choice([0.0, 0.0, 0.3]), rng.choice([0.0, 0.0, 0.1])
    feed = float(rng.integers(50, 5000)) / text.scale
    text.rapid(chain.tip[0], unit(chain.axis[0]))
    for tip_, axis_ in zip(chain.tip[1:], unit(chain.axis[1:]), strict=True):
        if rng.random() < (0.8 if dense_feeds else 0.05):
            feed = round(float(rng.uniform(20, 4000)) / text.scale, 4)
        text.at_feed(feed)
        text.goto(tip_, axis_)
        if rng.random() < talk:
            text.say(str(rng.choice(BETWEEN)))
        if rng.random() < dwell:
            text.say(str(rng.choice(ACTING)))


# ---------------------------------------------------------------- arcs, holes, tools


def _arcs(text: _Text) -> None:
    """Arcs and lines in a plane, the tool upright; the normal points up: a plain CL file turns left about it."""
    rng, up = text.rng, np.array([0.0, 0, 1])
    here = np.round(np.round(rng.uniform(-30, 30, 3), 3) / text.scale, 4) * text.scale
    text.rapid(here + [0, 0, 20], up)
    text.at_feed(float(rng.integers(100, 2000)) / text.scale)
    text.goto(here, up)
    for _ in range(int(rng.integers(1, 5))):
        radius = float(np.round(10.0 ** rng.uniform(-0.5, 1.7), 3))
        begin, sweep = rng.uniform(0, 2 * np.pi), float(rng.choice([0.3, 1.2, np.pi / 2, 3.0, 4.5]))
        centre = np.round((here - radius * np.array([math.cos(begin), math.sin(begin), 0])) / text.scale, 6)
        radius = float(np.linalg.norm(here[:2] / text.scale - centre[:2]))
        begin = math.atan2(*((here / text.scale - centre)[1::-1]))
        end = centre + radius * np.array([math.cos(begin + sweep), math.sin(begin + sweep), 0])
        text.say("CIRCLE/" + ",".join(f"{v:.6f}" for v in (*centre, 0, 0, 1, radius)))
        text.say("GOTO/" + ",".join(f"{v:.6f}" for v in end))
        here = np.round(end, 6) * text.scale
        if rng.random() < 0.6:
            here = np.round((here + [*rng.normal(size=2) * 5, 0]) / text.scale, 4) * text.scale
            text.goto(here, up)
    text.rapid(here + [0, 0, 20], up)


def _holes(text: _Text, fixed: bool, case: Case) -> None:
    rng = text.rng
    axis = np.array([0.0, 0, 1])
    if not fixed and rng.random() < 0.4:
        axis = tame(Chain(np.zeros((1, 3)), unit(rng.normal(size=(1, 3)) + [0, 0, 3]), np.ones(1)), case.machine).axis[
            0
        ]
    axis = np.round(unit(axis), 7)
    at = np.round(rng.uniform(-40, 40, (int(rng.integers(1, 4)), 3)), 3)
    per = "MMPM" if text.scale == 1.0 else "IPM"
    for round_ in range(int(rng.integers(1, 4))):
        word = str(rng.choice(["DRILL", "DRILL", "TAP", "DEEP", "BORE", "FACE"]))
        depth, feed = rng.uniform(2, 30) / text.scale, rng.uniform(50, 900) / text.scale
        clear, back = 3 / text.scale, 25 / text.scale
        text.rapid(at[0] + 25 * axis, axis)
        dwell = ",DWELL,0.5" if rng.random() < 0.3 else ""
        text.say(f"CYCLE/{word},FEDTO,{depth:.4f},{per},{feed:.4f},RAPTO,{clear:.4f},RTRCTO,{back:.4f}{dwell}")
        for place in at if rng.random() < 0.7 else at[::-1]:
            text.goto(place, axis)
        text.say("CYCLE/OFF")
        between = int(rng.integers(0, 3))
        text.say(*(str(rng.choice((*BETWEEN, *ACTING[:3], "SPINDL/OFF"))) for _ in range(between)))
        if round_ == 0 and rng.random() < 0.3:
            text.rapid(at[-1] + 60 * axis, axis)
        if rng.random() < 0.6:
            _tool(text)
    text.feed = math.nan
    text.rapid(at[-1] + 80 * axis, axis)


def _tool(text: _Text) -> None:
    rng = text.rng
    number = int(rng.integers(1, 40))
    if not text.one_tool or not any(line.startswith("LOADTL") for line in text.lines):
        text.say(f"LOADTL/{number}")
    if rng.random() < 0.7:
        text.say(f"SPINDL/{int(rng.integers(500, 20000))},RPM,CLW")


# ---------------------------------------------------------------- trials


def trial(seed: int, *, flips: bool = True, only: str = "") -> Trial:
    """Program of a seed with a control, form, machine and settings at random; the same each time."""
    rng = np.random.default_rng(seed)
    cases = [case for case in RUNNABLE if only in str(case)]
    case = cases[int(rng.integers(len(cases)))]
    form = case.choose(endless=True)
    fixed = form.orientation == "fixed"
    units = "inch" if rng.random() < 0.25 else "mm"
    one_tool = not case.tcp and case.machine.startswith(("head", "nutated"))
    text = _Text(rng, 25.4 if units == "inch" else 1.0, one_tool)
    text.say("PARTNO TRIAL", "UNITS/INCHES" if units == "inch" else "UNITS/MM")
    _tool(text)
    kinds = [*CHAINS, "flip"] if flips and not fixed else [*CHAINS]
    parts = []
    for _ in range(int(rng.integers(1, 5))):
        kind = str(rng.choice([*kinds, "arcs", "holes", "holes"]))
        parts.append(kind)
        if kind == "holes":
            _holes(text, fixed, case)
        elif kind == "arcs":
            _arcs(text)
        else:
            _chain(text, case, fixed, kind)
        if rng.random() < 0.4:
            _tool(text)
    text.say("SPINDL/OFF", "FINI")
    cl, settings = "\n".join(text.lines) + "\n", _settings(rng, seed, form)
    own = np.random.default_rng((seed, 2))  # so that programs stay
    digits = str(own.choice(["", "", "3", "4", "5", "6"]))
    if int(digits or 0) > form.table.digits.most:
        digits = ""
    planned = bool(own.random() < PLANNED) and sum(line.startswith("GOTO") for line in text.lines) <= PLANNED_LINES
    more = np.random.default_rng((seed, 3))
    native = "holes" in parts and bool(more.random() < 0.4)
    if form.long_lines and not settings.lines and more.random() < 0.25:
        settings = settings.but(lines="long")
    if more.random() < 0.1:
        settings = _with_axis_tolerance(settings, float(np.round(10.0 ** more.uniform(-2, 0.7), 3)))
    return Trial(seed, case, settings, units, cl, tuple(parts), digits, planned, native)


def _with_axis_tolerance(settings: Settings, degrees: float) -> Settings:
    """Settings with a tolerance of the tool axis, where the rest of them goes with one."""
    try:
        return settings.but(axis_tolerance=degrees)
    except SettingsError:
        return settings


def _settings(rng: np.random.Generator, seed: int, form: Form) -> Settings:
    options: dict[str, object] = {
        "tolerance": float(np.round(10.0 ** rng.uniform(-3, 0), 6)),
        "axis_length": float(np.round(10.0 ** rng.uniform(0, 2.3), 3)),
    }
    if rng.random() < 0.25:
        options["method"] = "zhang2016"
    elif rng.random() < 0.2:
        rng.uniform(0.3, 2.5, 2)  # numbers of an option that is gone: other programs stay as they are
    if rng.random() < 0.2:
        options["reversal_angle"] = float(rng.choice([30.0, 90.0, 175.0, 180.0]))
    if rng.random() < 0.2:
        options["axis_step"] = float(rng.choice([0.1, 1.0, 10.0]))
    _other_methods(np.random.default_rng((seed, 1)), form, options)
    try:
        return Settings(**options)  # type: ignore[arg-type]
    except SettingsError:
        return Settings(tolerance=max(0.002, float(options["tolerance"])), axis_length=10.0)  # type: ignore[arg-type]


def _other_methods(rng: np.random.Generator, form: Form, options: dict[str, object]) -> None:
    """Methods that some forms do not hold, and long lines; by a generator of its own, so that programs stay."""
    runs = not form.curves or form.curve in ("bspline", "g6.2")
    if rng.random() < 0.25 and runs:
        options["method"] = "global"
    if form.long_lines and rng.random() < 0.4:
        options["lines"] = str(rng.choice(["long", "dense"]))
