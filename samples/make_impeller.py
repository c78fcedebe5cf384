"""Writes impeller.cls and impeller.aptsource: flank milling of a ruled impeller blade, the same path in two dialects.

The blade is analytic. Its camber surface is ruled between a hub and a shroud curve; in the meridional plane both are
quarters of an ellipse that turn the flow from axial to radial, and their polar angles are polynomials. The tool lies
along the rules, one tool radius and half a blade thickness beside them. Depth by depth it goes down one side, round
the square trailing edge, and up the other side.

    python samples/make_impeller.py [FOLDER]
"""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

HERE = Path(__file__).resolve().parent

TOOL_DIAMETER = 4.0
BLADE_THICKNESS = 1.6
OFFSET = (TOOL_DIAMETER + BLADE_THICKNESS) / 2
DEPTHS = 6  #: passes from the shroud down to the hub

CHORD = 0.005  #: mm between path and chord, as CAM systems finish
LONGEST = 2.0  #: mm between poses
LARGEST_TURN = np.radians(3.0)  #: of the axis between poses

RUN_OUT = 3.0  #: mm straight on beyond both edges of the blade
ENGAGE = 5.0  #: mm along the axis at engage and retract feed
CLEARANCE = 40.0  #: mm along the axis for rapids

CUT_FEED, ENGAGE_FEED, RETRACT_FEED = 800.0, 250.0, 1500.0
SPEED = 12000.0


@dataclass(frozen=True)
class Edge:
    """A blade edge curve: radius, height and polar angle over t from 0 (inlet) to 1 (outlet); mm and rad."""

    inlet_radius: float
    outlet_radius: float
    inlet_height: float
    outlet_height: float
    angle: tuple[float, float, float]  #: polynomial in t, constant term first

    def at(self, t: Floats) -> Floats:
        """Points (n, 3)."""
        turn = np.pi / 2 * t
        radius = self.inlet_radius + (self.outlet_radius - self.inlet_radius) * (1 - np.cos(turn))
        height = self.inlet_height + (self.outlet_height - self.inlet_height) * np.sin(turn)
        angle = self.angle[0] + t * (self.angle[1] + t * self.angle[2])
        return np.stack((radius * np.cos(angle), radius * np.sin(angle), height), axis=1)


HUB = Edge(12.0, 42.0, 30.0, 0.0, (0.00, 0.50, 0.22))
SHROUD = Edge(24.0, 42.0, 30.0, 6.0, (0.02, 0.72, -0.06))


@dataclass(frozen=True)
class Step:
    """Poses reached in one manner: `kind` is rapid, engage, cut or retract."""

    kind: str
    tip: Floats
    axis: Floats


def unit(vectors: Floats) -> Floats:
    """Vectors of length 1."""
    scaled: Floats = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return scaled


def flank(t: Floats, depth: float, side: int) -> tuple[Floats, Floats]:
    """Tips and axes beside the rules at t; depth 1 is the hub, side +1 or -1.

    The normal at the middle of a rule halves the error that its twist leaves at the ends.
    """
    hub, shroud = HUB.at(t), SHROUD.at(t)
    axis = unit(shroud - hub)
    little = 1e-5
    along = HUB.at(t + little) - HUB.at(t - little) + SHROUD.at(t + little) - SHROUD.at(t - little)
    tip = shroud + depth * (hub - shroud) + side * OFFSET * unit(np.cross(along, axis))
    return tip, axis


def places(depth: float, side: int) -> Floats:
    """Values of t from inlet to outlet that keep chord, length and turn between poses."""
    t = np.linspace(0, 1, 2001)
    tip, axis = flank(t, depth, side)
    speed = np.gradient(tip, t, axis=0)
    length = np.linalg.norm(speed, axis=1)
    curvature = np.linalg.norm(np.cross(speed, np.gradient(speed, t, axis=0)), axis=1) / length**3
    turn = np.linalg.norm(np.gradient(axis, t, axis=0), axis=1)
    poses_per_t = np.maximum.reduce((length / LONGEST, length * np.sqrt(curvature / (8 * CHORD)), turn / LARGEST_TURN))
    count = np.concatenate(([0.0], np.cumsum((poses_per_t[1:] + poses_per_t[:-1]) / 2 * np.diff(t))))
    return np.interp(np.linspace(0, count[-1], int(np.ceil(count[-1])) + 1), count, t)


def one_pass(depth: float) -> list[Step]:
    """From clearance into the cut, round the blade and back to clearance."""
    tips, axes = [], []
    for side, way in ((1, 1), (-1, -1)):
        tip, axis = flank(places(depth, side)[::way], depth, side)
        before, after = unit(tip[0] - tip[1]), unit(tip[-1] - tip[-2])
        tips += [tip[:1] + RUN_OUT * before, tip, tip[-1:] + RUN_OUT * after]
        axes += [axis[:1], axis, axis[-1:]]
    cut = Step("cut", np.concatenate(tips)[1:], np.concatenate(axes)[1:])
    start, end = np.concatenate(tips)[:1], cut.tip[-1:]
    first, last = axes[0], cut.axis[-1:]
    return [
        Step("rapid", np.concatenate((start + CLEARANCE * first, start + ENGAGE * first)), np.repeat(first, 2, axis=0)),
        Step("engage", start, first),
        cut,
        Step("retract", end + ENGAGE * last, last),
        Step("rapid", end + CLEARANCE * last, last),
    ]


def path() -> list[Step]:
    """All passes."""
    return [step for depth in range(1, DEPTHS + 1) for step in one_pass(depth / DEPTHS)]


FEEDS = {"engage": ENGAGE_FEED, "cut": CUT_FEED, "retract": RETRACT_FEED}


def digits(values: Floats, decimals: int, width: int = 0) -> str:
    """Numbers with commas between; no negative zero."""
    return ",".join(f"{value:{width}.{decimals}f}" for value in (np.round(values, decimals) + 0.0).tolist())


def nx(steps: list[Step]) -> str:
    """CLSF as NX writes it: the axis only where it changes, colours for the kinds of motion."""
    colours = {"rapid": 186, "engage": 42, "cut": 31, "retract": 37}
    lines = [
        "TOOL PATH/IMPELLER_BLADE_FLANK,TOOL,BALL_D4",
        f"TLDATA/MILL,{TOOL_DIAMETER:.4f},{TOOL_DIAMETER / 2:.4f},75.0000,0.0000,0.0000",
        "MSYS/0.0000,0.0000,0.0000,1.0000000,0.0000000,0.0000000,0.0000000,1.0000000,0.0000000",
        "$$ centerline data",
        "PAINT/PATH",
        "PAINT/SPEED,10",
        "LOAD/TOOL,1",
        f"SPINDL/RPM,{SPEED:.0f},CLW",
        "COOLNT/ON",
    ]
    last_axis = ""
    for step in steps:
        lines.append(f"PAINT/COLOR,{colours[step.kind]}")
        if step.kind in FEEDS:
            lines.append(f"FEDRAT/MMPM,{FEEDS[step.kind]:.4f}")
        for tip, axis in zip(step.tip, step.axis, strict=True):
            said = digits(axis, 7)
            lines += ["RAPID"] * (step.kind == "rapid")
            lines.append(f"GOTO/{digits(tip, 4)}" + (f",{said}" if said != last_axis else ""))
            last_axis = said
    lines += ["COOLNT/OFF", "SPINDL/OFF", "PAINT/SPEED,10", "PAINT/TOOL,NOMORE", "END-OF-PATH"]
    return "\n".join(lines) + "\n"


def catia(steps: list[Step]) -> str:
    """APT source as CATIA V5 writes it: six numbers in every GOTO."""
    lines = [
        "$$ -----------------------------------------------------------------",
        "$$     CATIA APT VERSION 1.0",
        "$$ -----------------------------------------------------------------",
        "$$ Manufacturing Program.1",
        "$$  Part Operation.1",
        "$$*CATIA0",
        "$$ Manufacturing Program.1",
        "$$     1.00000     0.00000     0.00000     0.00000",
        "$$     0.00000     1.00000     0.00000     0.00000",
        "$$     0.00000     0.00000     1.00000     0.00000",
        "PARTNO IMPELLER BLADE",
        "$$ OPERATION NAME : Tool Change.1",
        "$$  Start generation of : Tool Change.1",
        "MULTAX",
        "$$ TOOLCHANGEBEGINNING",
        f"CUTTER/{TOOL_DIAMETER:10.6f},{TOOL_DIAMETER / 2:10.6f},{0:10.6f},{TOOL_DIAMETER / 2:10.6f},{0:10.6f},$",
        f"       {0:10.6f},{50:10.6f}",
        f"TOOLNO/1,{TOOL_DIAMETER:12.6f}",
        "TPRINT/T1 Ball End Mill D 4",
        "LOADTL/1",
        "$$ TOOLCHANGEEND",
        "$$  End of generation of : Tool Change.1",
        "$$ OPERATION NAME : Multi-Axis Flank Contouring.1",
        "$$  Start generation of : Multi-Axis Flank Contouring.1",
        f"SPINDL/{SPEED:10.4f},RPM,CLW",
        "COOLNT/ON",
    ]
    for step in steps:
        if step.kind in FEEDS:
            lines.append(f"FEDRAT/{FEEDS[step.kind]:10.4f},MMPM")
        for tip, axis in zip(step.tip, step.axis, strict=True):
            lines += ["RAPID"] * (step.kind == "rapid")
            lines.append(f"GOTO  /{digits(tip, 5, 11)},{digits(axis, 6, 9)}")
    lines += [
        "COOLNT/OFF",
        "$$  End of generation of : Multi-Axis Flank Contouring.1",
        "SPINDL/OFF",
        "FINI",
    ]
    return "\n".join(lines) + "\n"


def main(folder: Path) -> None:
    """Write both files into the folder."""
    steps = path()
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in (("impeller.cls", nx(steps)), ("impeller.aptsource", catia(steps))):
        (folder / name).write_text(text, encoding="ascii", newline="\n")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else HERE)
