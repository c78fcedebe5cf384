"""Small random programs dense in what happens around holes: modal cycles, tools, GOHOME, rapids along one line.

``python -m verify.hole_programs 0 1000`` in the folder of the tests writes each for a control, form and machine at
random, with or without cycles of the control, and verifies it; exit code 1 for any text that is refused falsely.
"""

from __future__ import annotations

import sys
import warnings
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np

from cornersmooth.cl import read
from cornersmooth.errors import CornersmoothError
from cornersmooth.settings import Settings
from nc.cases import RUNNABLE
from oracle.motion import unit
from verify.random_programs import Trial
from verify.sweep import judged

#: statements that may stand anywhere
STATEMENTS = (
    "COOLNT/ON",
    "COOLNT/OFF",
    "COOLNT/MIST",
    "SPINDL/OFF",
    "SPINDL/800,RPM,CLW",
    "SPINDL/3000,RPM,CLW",
    "STOP",
    "OPSTOP",
    "DELAY/0.5",
    "PPRINT/MARK",
)

KINDS = ("DRILL", "DRILL", "FACE", "TAP", "DEEP", "BORE", "BRKCHP")

#: heights above a hole that rapids and feeds go to, mm
HEIGHTS = (0.0, 0.0, 3.0, 20.0, 25.0, 60.0)


def hole_trial(seed: int) -> Trial:
    """Program of a seed, the same each time."""
    rng = np.random.default_rng((seed, 11))
    case = RUNNABLE[int(rng.integers(len(RUNNABLE)))]
    form = case.choose(endless=True)
    axis = np.array([0.0, 0.0, 1.0])
    if form.orientation != "fixed" and rng.random() < 0.4:
        axis = np.round(unit(np.array([*rng.normal(size=2) * 0.1, 1.0])), 7)
    places = np.round(rng.uniform(-40, 40, (int(rng.integers(1, 4)), 3)), 3)
    if rng.random() < 0.5:  # all in one line
        places = np.round(places[0] + np.outer(rng.choice([-12.0, 0.0, 5.0], len(places)), axis), 4)
    one_tool = not case.tcp and case.machine.startswith(("head", "nutated"))
    lines = ["UNITS/MM", "LOADTL/1", "SPINDL/2000,RPM,CLW"]

    def goto(height: float) -> str:
        tip = places[int(rng.integers(len(places)))] + height * axis
        return "GOTO/" + ",".join([*(f"{value:.4f}" for value in tip), *(f"{value:.7f}" for value in axis)])

    def cycle() -> list[str]:
        kind = str(rng.choice(KINDS))
        more = ",DWELL,0.5" if rng.random() < 0.2 and kind != "TAP" else ""
        more += ",STEP,4" if kind in ("DEEP", "BRKCHP") else ""
        depth, feed = rng.choice([4.0, 12.0]), rng.choice([100, 250])
        return [f"CYCLE/{kind},FEDTO,{depth},MMPM,{feed},RAPTO,3,RTRCTO,{rng.choice([3, 20])}{more}"]

    def holes() -> list[str]:
        return [goto(0.0) for _ in range(int(rng.integers(1, 3)))]

    def tool() -> list[str]:
        spindle = ["SPINDL/1500,RPM,CLW"] if rng.random() < 0.7 else []
        return spindle if one_tool else [f"LOADTL/{int(rng.integers(1, 5))}", *spindle]

    kinds: dict[str, tuple[float, Callable[[], list[str]]]] = {
        "cycle": (2, lambda: [*cycle(), *holes()]),
        "holes": (1, holes),
        "off": (2, lambda: ["CYCLE/OFF"]),
        "tool": (2, tool),
        "home": (1, lambda: ["GOHOME"]),
        "rapid": (2, lambda: ["RAPID", goto(float(rng.choice(HEIGHTS)))]),
        "feed": (1, lambda: [f"FEDRAT/{rng.choice([100, 300])},MMPM", goto(float(rng.choice(HEIGHTS)))]),
        "statement": (3, lambda: [str(rng.choice(STATEMENTS))]),
    }
    weight = np.array([share for share, _ in kinds.values()])
    chosen = rng.choice(len(kinds), int(rng.integers(1, 14)), p=weight / weight.sum())
    if rng.random() < 0.7:
        lines += ["RAPID", goto(60.0)]
    if chosen.size and not any("GOTO" in line for line in lines):
        lines += ["FEDRAT/300,MMPM"]
    for k in chosen.tolist():
        lines += list(kinds.values())[k][1]()
    if rng.random() < 0.5:
        lines += ["CYCLE/OFF", "RAPID", goto(60.0)]
    cl = "\n".join([*lines, "SPINDL/OFF", "FINI", ""])
    settings = Settings(tolerance=float(10.0 ** rng.uniform(-3, -0.5)), axis_length=20.0)
    return Trial(seed, case, settings, "mm", cl, ("holes",), native=bool(rng.random() < 0.5))


def main() -> int:
    """Judge the programs of a range of seeds: FROM TO FOLDER, where the refused are kept; 0 to 400 without them."""
    first, last = (int(word) for word in sys.argv[1:3] or ("0", "400"))
    keep = Path(sys.argv[3]) if sys.argv[3:] else None
    warnings.simplefilter("error")
    count: Counter[str] = Counter()
    for seed in range(first, last):
        one = hole_trial(seed)
        try:
            outcome, said = judged(one, read(one.cl.encode(), name="holes.cls"), oracle=False)
        except CornersmoothError as refusal:
            outcome, said = f"unreadable {refusal.code}", str(refusal)
        count[outcome] += 1
        if outcome.isupper():
            print(f"{outcome} {one}: {said}", flush=True)
            if keep is not None:
                (keep / f"{seed}.cls").write_text(one.cl)
    print(", ".join(f"{word} {number}" for word, number in sorted(count.items())))
    return int(any(word.isupper() for word in count))


if __name__ == "__main__":
    sys.exit(main())
