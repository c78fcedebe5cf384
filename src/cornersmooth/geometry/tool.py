"""The shape of the tool: a body of revolution from CUTTER, TLDATA or the command line.

In the meridian plane (ρ from the axis, h up from the tip) the tool is a bottom line, an arc and a side line. A body
with a corner radius r is what a disk of radius r covers when its centre moves over a sharp body; so the distance to the
tool is the distance to the sharp body less r, inside and outside.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from cornersmooth.errors import SettingsError
from cornersmooth.model import Floats, Program, Statement

_COMMENTED = re.compile(r"->\s*CUTTER\s*/\s*(.*)", re.IGNORECASE)  #: a cutter as Creo writes it: in a comment


@dataclass(frozen=True)
class Tool:
    """A body of revolution about the tool axis, its tip at the origin."""

    diameter: float  #: mm
    corner_radius: float  #: mm: r; half the diameter for a ball
    #: mm: Distance of the centre of the corner arc from the axis (APT's e) and from the tip along the axis (f).
    centre_out: float
    centre_up: float
    tip_angle: float = 0.0  #: degrees: Rise of the bottom line from the tip outwards (APT's α)
    taper: float = 0.0  #: degrees: Angle between side line and axis, positive where the tool widens upwards (APT's β)
    length: float = 0.0  #: mm: For drawing; the side line goes on without end for measuring. 0 where the file has none.

    def __post_init__(self) -> None:
        numbers = (self.diameter, self.corner_radius, self.centre_out, self.centre_up, self.tip_angle, self.taper)
        good = all(math.isfinite(number) for number in numbers)
        if not (good and self.diameter > 0.0 and self.corner_radius >= 0.0 and self.centre_out >= 0.0):
            raise SettingsError("CS270", "the tool has no size", "give diameter and corner radius, as in --tool 10,2")
        if not (abs(self.taper) < 80.0 and 0.0 <= self.tip_angle < 89.0):
            raise SettingsError("CS270", "the angles of the tool are too steep", "give a taper below 80 degrees")

    @classmethod
    def of(
        cls, diameter: float, corner_radius: float = 0.0, taper: float = 0.0, length: float = 0.0, tip_angle: float = 0
    ) -> Tool:
        """Tool of a diameter, measured where side and bottom line would meet; a ball where the radius is half of it.

        CS270: such a tool cannot be.
        """
        if corner_radius > 0.5 * diameter * (1.0 + 1e-9):
            what = f"corner radius {corner_radius:g} mm is more than half of {diameter:g} mm"
            raise SettingsError("CS270", what, "give D,r")
        tip, side = math.radians(tip_angle), math.radians(taper)
        if corner_radius >= 0.5 * diameter * (1.0 - 1e-9):
            return cls(diameter, corner_radius, 0.0, corner_radius / math.cos(tip), tip_angle, taper, length)
        slope = math.cos(side) - math.tan(tip) * math.sin(side)
        out = 0.5 * diameter + corner_radius * (math.sin(side) / math.cos(tip) - 1.0) / slope
        out = max(out, 0.0)
        up = out * math.tan(tip) + corner_radius / math.cos(tip)
        return cls(diameter, corner_radius, out, up, tip_angle, taper, length)

    def describe(self) -> str:
        """Few words with units."""
        ball = self.centre_out == 0.0 and self.corner_radius > 0.0
        text = f"{'ball' if ball else 'cutter'} {self.diameter:g} mm"
        text += f", corner radius {self.corner_radius:g} mm" if self.corner_radius and not ball else ""
        text += f", taper {self.taper:g}°" if self.taper else ""
        return text + (f", tip angle {self.tip_angle:g}°" if self.tip_angle else "")

    def profile(self, sine: Floats, height: Floats) -> tuple[Floats, Floats, Floats]:
        """Points of the corner arc, then of the side line: ρ and h, mm, and sine of the drop of the outward normal.

        `sine` (c,) says where on the arc: 1 at its lowest point, the taper's sine at its upper end. `height` (s,) is
        that of points of the side line over the tip, mm.
        """
        side = math.radians(self.taper)
        cosine = np.sqrt(1.0 - sine * sine)
        radius = self.side_radius(height)
        out = np.concatenate((self.centre_out + self.corner_radius * cosine, radius))
        up = np.concatenate((self.centre_up - self.corner_radius * sine, height))
        return out, up, np.concatenate((sine, np.full(len(height), math.sin(side))))

    @property
    def side_from(self) -> float:
        """Height of the lower end of the side line, mm."""
        return self.centre_up - self.corner_radius * math.sin(math.radians(self.taper))

    def side_radius(self, height: Floats) -> Floats:
        """Distance of the side line from the axis at heights above `side_from`, mm."""
        side = math.radians(self.taper)
        low = self.centre_out + self.corner_radius * math.cos(side)
        return low + (height - self.side_from) * math.tan(side)

    def distance(self, out: Floats, up: Floats) -> Floats:
        """Signed distance, mm, of points at `out` ≥ 0 from the axis and `up` above the tip; negative inside.

        Exact outside; inside, the distance to the nearest of bottom, corner and side.
        """
        side, tip = math.radians(self.taper), math.radians(self.tip_angle)
        x, y = out - self.centre_out, up - self.centre_up
        beside = x * math.cos(side) - y * math.sin(side)
        along_side = x * math.sin(side) + y * math.cos(side)
        below = x * math.sin(tip) - y * math.cos(tip)
        along_bottom = -x * math.cos(tip) - y * math.sin(tip)
        on_side = (beside > 0.0) & (along_side >= 0.0)
        on_bottom = ~on_side & (below > 0.0) & (along_bottom >= 0.0)
        inside = np.maximum(beside, below) <= 0.0
        nearest = np.select((inside, on_side, on_bottom), (np.maximum(beside, below), beside, below), np.hypot(x, y))
        reach = self.centre_out / math.cos(tip)
        over_the_axis = on_bottom & (along_bottom > reach)  # nearest to the apex
        apex = self.centre_up - self.centre_out * math.tan(tip)
        return np.where(over_the_axis, np.hypot(out, up - apex), nearest) - self.corner_radius


def parse_tool(text: str) -> Tool:
    """Tool of ``D[,r[,taper[,length]]]`` in mm and degrees (SettingsError CS270)."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if not 1 <= len(numbers) <= 4:
        hint = "write D,r or D,r,taper,length: --tool 10,5,0,40"
        raise SettingsError("CS270", f"--tool {text!r} is not a tool", hint)
    return Tool.of(*numbers)


def tools_of(program: Program) -> list[tuple[int, Tool, int]]:
    """Tools that the CL file describes: first pose, tool and CL line of each, in order.

    A cutter that cannot be is left out.
    """
    found: list[tuple[int, Tool, int]] = []
    for statement in program.statements:
        try:
            tool = _tool(statement, program.mm_per_unit)
        except SettingsError:
            continue
        if tool is not None and (not found or found[-1][1] != tool):
            found.append((statement.pose, tool, statement.line))
    return found


def _tool(statement: Statement, unit: float) -> Tool | None:
    numbers = [float(value) for value in statement.args if isinstance(value, (int, float))]
    if statement.word == "CUTTER":
        return _apt_cutter(numbers, unit)
    if statement.word == "TLDATA":
        if not numbers:
            return None
        diameter, radius, length, taper, tip = [*numbers, *[0.0] * 5][:5]
        # the last two numbers of a drill are its flute length and number, not angles
        angles = (taper, tip) if "MILL" in statement.args[:1] else (0.0, 0.0)
        return Tool.of(diameter * unit, radius * unit, angles[0], length * unit, angles[1])
    if statement.word == "$$" and (written := _COMMENTED.search(statement.text)):
        parts = written[1].split(",")
        try:
            return _apt_cutter([float(part) for part in parts], unit)
        except ValueError:
            return None
    return None


def _apt_cutter(numbers: list[float], unit: float) -> Tool | None:
    """CUTTER/d,r,e,f,α,β,h; shorter ones are diameter, corner radius and height."""
    if not numbers:
        return None
    if len(numbers) < 6:
        numbers = [*numbers, 0.0, 0.0, 0.0][:3]
        return Tool.of(numbers[0] * unit, numbers[1] * unit, 0.0, numbers[2] * unit)
    diameter, radius, out, up, tip, side = (
        number * (1.0 if index > 3 else unit) for index, number in enumerate(numbers[:6])
    )
    length = numbers[6] * unit if len(numbers) > 6 else 0.0
    if up > 0.0 or radius == 0.0:
        return Tool(diameter, radius, out, up, tip, side, length)
    return Tool.of(diameter, radius, side, length, tip)
