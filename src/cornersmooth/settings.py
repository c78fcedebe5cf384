"""Every option of smoothing and of limits: name, unit, default, bounds, help. Methods of smoothing by name.

No other module holds such a number. The command line, keys of ``cornersmooth.toml``, reports and their schema come from
the one declaration here.

How a method makes its curves is in a module of its own, which is imported when the method is used. To add one, write
that module with a `cornersmooth.smoothing.construction.Construction` named ``CONSTRUCTION``, and an entry in `METHODS`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from numbers import Real
from types import MappingProxyType
from typing import Any, Final, Literal, TypeVar

from cornersmooth.errors import SettingsError


@dataclass(frozen=True)
class Method:
    """A way to make the pair of curves."""

    name: str  #: As on the command line and in reports
    summary: str  #: A few words for the help
    module: str  #: Where its `CONSTRUCTION` is
    #: Whether one parameter drives both curves. Only then do the errors at a common parameter bound the distances of
    #: the paths, and can rotary words follow the curves.
    one_parameter: bool = True


#: in the order of tables, the oldest first
METHODS: Mapping[str, Method] = MappingProxyType(
    {
        method.name: method
        for method in (
            Method("zhang2016", "the paper as published", "cornersmooth.smoothing.zhang2016", one_parameter=False),
            Method(
                "proportional",
                "both segments cut at the same fraction, one parameter for both curves",
                "cornersmooth.smoothing.proportional",
            ),
            Method(
                "global",
                "one pair of curves for a whole run of corners, as smooth as the tolerance allows",
                "cornersmooth.smoothing.global_runs",
            ),
        )
    }
)

#: what suits the form: see `Settings.with_method`
AUTO = "auto"

#: of lines, and of curves
DEFAULT_METHOD, CURVES_METHOD = "proportional", "global"


def option(
    default: Any,
    help: str = "",
    *,
    unit: str = "",
    bounds: tuple[float, float] | None = None,
    flags: str = "",
    instead: str = "",
) -> Any:
    """Field of an option.

    Parameters
    ----------
    help : str
        What it is, as the command line shows it; empty where that has no such option.
    unit : str
        As in ``mm/s2``.
    bounds : (float, float), optional
        Closed, of one number or several.
    flags : str
        On the command line, beside the long one of the field's name; a long one here takes its place.
    instead : str
        Field whose value counts where this one is None.
    """
    return field(
        default=default,
        metadata={"help": help, "unit": unit, "bounds": bounds, "flags": flags, "instead": instead},
    )


def key_of(name: str, unit: str) -> str:
    """Key of an option in a record, with its unit: ``accel_mm_per_s2``."""
    return f"{name}_{unit.replace('/', '_per_')}" if unit else name


#: types of plain values, by the annotations of options
_KINDS: Final = {"float": Real, "bool": bool, "str": str}


def _fits(value: Any, hint: str) -> bool:
    """Whether a value is what an annotation says: a plain value, or a tuple of such; any other annotation takes all."""
    if hint.startswith("tuple["):
        kinds = hint[len("tuple[") : -1].split(", ")
        so_many = isinstance(value, (tuple, list)) and ("..." in kinds or len(value) == len(kinds))
        return so_many and all(_fits(one, kinds[0]) for one in value)
    return hint not in _KINDS or (isinstance(value, _KINDS[hint]) and (hint == "bool" or not isinstance(value, bool)))


Record = TypeVar("Record", bound="OptionFields")


class OptionFields:
    """Fields that `option` makes, of a frozen dataclass."""

    def __post_init__(self) -> None:
        """Refuse values that do not fit the annotations of their fields (CS202)."""
        for item in self.__dataclass_fields__.values():  # type: ignore[attr-defined]
            value, hint = getattr(self, item.name), item.type.removesuffix(" | None")
            if not _fits(value, hint) and not (value is None and hint != item.type):
                raise SettingsError("CS202", f"{item.name} is {value!r}", f"give a {hint}")

    def _value(self, name: str) -> Any:
        """Value of an option, or of that which counts instead."""
        value = getattr(self, name)
        item = self.__dataclass_fields__[name]  # type: ignore[attr-defined]
        return getattr(self, item.metadata["instead"] or name) if value is None else value

    def as_dict(self) -> dict[str, Any]:
        """Plain values in field order, for reports: numbers in the units of their keys, words, None for nothing."""
        items = self.__dataclass_fields__.values()  # type: ignore[attr-defined]
        return {key_of(item.name, item.metadata["unit"]): self._value(item.name) for item in items}


def described(record: type[Record]) -> type[Record]:
    """Add the options of a record to its docstring: their units, and helps as the command line has them."""
    lines = [record.__doc__ or "", "", "Attributes", "----------"]
    for item in fields(record):  # type: ignore[arg-type]
        unit = f", {item.metadata['unit']}" if item.metadata["unit"] else ""
        lines += [f"{item.name} : {item.type}{unit}", f"    {item.metadata['help'] or f'Default {item.default}.'}"]
    record.__doc__ = "\n".join(lines)
    return record


Lines = Literal["dense", "long"]


@described
@dataclass(frozen=True)
class Settings(OptionFields):
    """What `cornersmooth.smooth` promises and how it goes about it. Lengths in mm, angles in degrees."""

    #: ε: of the written tip path and axis-point path (docs/method.md)
    tolerance: float = option(
        0.01, "Largest deviation of the written path.", unit="mm", bounds=(1e-6, 10.0), flags="-e"
    )
    #: H. An axis tolerance takes its place: H follows from it then, whatever is given.
    axis_length: float = option(
        10.0,
        "Distance from the tool tip to the second point that keeps the tolerance: the length of the cutting edge.",
        unit="mm",
        bounds=(1e-3, 1e4),
        flags="-H",
    )
    #: τ: in place of ε at the axis point, what the tool axis may be off where the tip is within ε
    axis_tolerance: float | None = option(
        None,
        "Largest deviation of the tool axis where the tip is within -e, in place of -e at the axis point (-H): for"
        " ball-end mills, whose centre is all that counts.",
        unit="deg",
        bounds=(1e-4, 45.0),
    )
    #: A name in `cornersmooth.settings.METHODS`, or "auto" for what suits the form: global in curves, if nothing that
    #: is given is against it, else proportional.
    method: str = option(
        AUTO,
        "How the curves are made. With auto: global in curves (g6.2, bspline, poly, spl); in lines proportional, or "
        "global where its program is faster under --limits, given by itself: --machine alone does not compare them. "
        + " ".join(f"With {item.name}: {item.summary}." for item in METHODS.values())
        + " Global takes less time on the machine and about a block a pose in curves; on LinuxCNC it takes more time.",
    )
    #: A corner that turns by more (in the six-dimensional sense) stays sharp.
    reversal_angle: float = option(170.0, unit="deg", bounds=(1.0, 180.0))
    #: A corner next to a segment whose axis turns by more stays sharp: the ruled motion is not a motion any more.
    max_axis_step: float = option(90.0, unit="deg", bounds=(1.0, 90.0))
    #: in dense output
    chord_tolerance: float | None = option(
        None,
        "Largest distance between the written lines and the curve. [default: a tenth of -e, at most 0.0005]",
        unit="mm",
        bounds=(1e-7, 1.0),
        flags="--chord",
    )
    #: Dense lines follow the curves as closely as 0.00005 mm where none is passed sooner at the programmed feed. 0 for
    #: lines by the chord tolerance alone; None for what the control's table says, and without a control 0.
    block_time: float | None = option(
        None,
        "Shortest time in which the control takes a block, as in 1ms. At the programmed feed, no line along a curve "
        "takes less. [default: that of the control's table]",
        unit="s",
        bounds=(0.0, 1.0),
    )
    #: Largest change of axis in one written line next to a rounded corner; None for what ε and H ask for.
    axis_step: float | None = option(None, unit="deg", bounds=(1e-3, 90.0))
    lines: Lines | None = option(
        None, "Lines close to the curves, or as few as -e allows. [default: what suits the control]"
    )
    #: Parts of what the rounding of the digits leaves of ε: for the curves, and for long lines along them. What is
    #: left of `line_share` is for what the control does to lines by itself.
    curve_share: float = option(1.0, bounds=(0.01, 1.0))
    line_share: float = option(1.0, bounds=(0.01, 1.0))
    #: Part of ε within which the control rounds the corners of lines by itself, where it has a word for it.
    blend_share: float = option(0.1, bounds=(0.0, 1.0))
    #: Whether a corner where the feed changes may be rounded; false for output that cannot change F inside a curve,
    #: and has no curves at a feed per revolution.
    round_feed_changes: bool = option(True)
    #: Step of the written tip coordinates; half of it per axis is taken off ε. 0 for no rounding.
    tip_resolution: float = option(0.0, unit="mm", bounds=(0.0, 10.0))
    #: Step of the written axis points, or of the written vectors times H.
    axis_point_resolution: float = option(0.0, unit="mm", bounds=(0.0, 10.0))
    #: Poses closer than this, in tip and axis point, are one pose.
    duplicate_distance: float = option(1e-6, unit="mm", bounds=(0.0, 0.01))
    #: By how much poses that are almost doubled are moved at most: taken off ε, as digits are. Smoothing finds it.
    pose_shift: float = option(0.0, unit="mm", bounds=(0.0, 10.0))
    #: A straight remainder shorter than this between two transitions is not written as a line of its own.
    shortest_line: float = option(1e-3, unit="mm", bounds=(0.0, 1.0))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.method not in (AUTO, *METHODS):
            raise SettingsError("CS201", f"unknown method {self.method!r}", f"use {' or '.join((AUTO, *METHODS))}")
        if self.lines not in (None, "dense", "long"):
            raise SettingsError("CS201", f"unknown lines {self.lines!r}", "use dense or long")
        for name, (low, high) in BOUNDS.items():
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and low <= float(value) <= high):
                raise SettingsError("CS202", f"{name} is {value:g}", f"give a value from {low:g} to {high:g}")
        if self.axis_tolerance is not None:
            object.__setattr__(self, "axis_length", self._check_axis_tolerance(self.axis_tolerance))
        if self.tip_tolerance <= 0 or self.axis_point_tolerance <= 0:
            raise SettingsError(
                "CS203",
                f"tolerance {self.tolerance:g} mm is finer than the written digits can hold",
                self._coarser,
            )

    def with_method(self, *, curves: bool = False) -> Settings:
        """Put a method in the place of "auto": what suits lines, or curves; a method that is named already stays."""
        if self.method != AUTO:
            return self
        return self.but(method=CURVES_METHOD if curves else DEFAULT_METHOD)

    def _check_axis_tolerance(self, degrees: float) -> float:
        """H that goes with an axis tolerance, mm."""
        low, high = BOUNDS["axis_length"]
        longest = (1.0 + AXIS_POINT_SHARES) * self.tolerance
        length = longest / chord_of(degrees)
        if not low <= length <= high:
            bound, word = (longest / low, "at most") if length < low else (longest / high, "at least")
            raise SettingsError(
                "CS208",
                f"an axis tolerance of {degrees:g} deg does not go with a tolerance of {self.tolerance:g} mm",
                f"use {word} {math.degrees(bound):.2g} deg",
            )
        return length

    @property
    def _coarser(self) -> str:
        """What to do where the digits are too coarse for the tolerances."""
        if self.axis_tolerance is None:
            return f"use at least {2 * max(self._tip_rounding, self._axis_point_rounding):.2g} mm"
        axis = math.degrees(self._axis_point_rounding / self.axis_length)
        return f"use at least {2 * self._tip_rounding:.2g} mm and an axis tolerance of {2 * axis:.2g} deg"

    @property
    def axis_point_allowed(self) -> float:
        """What the axis point of the written motion may be off, mm: ε, or several times that with an axis tolerance.

        A tip off by ε or less and an axis point off by `AXIS_POINT_SHARES` ε or less, at one pose of the original, have
        an axis off by a chord of (1 + `AXIS_POINT_SHARES`) ε / H at most: H is such that this is τ.
        """
        return self.tolerance if self.axis_tolerance is None else AXIS_POINT_SHARES * self.tolerance

    @property
    def axis_scale(self) -> float:
        """Distance from the tip, mm, at which what the axis may turn shows as ε: H, or ε over the chord of τ."""
        return self.axis_length if self.axis_tolerance is None else self.tolerance / chord_of(self.axis_tolerance)

    @property
    def tip_tolerance(self) -> float:
        """What curves may use at the tip: ε less the rounding, half a step in each of three coordinates."""
        return self.curve_share * (self.tolerance - self._tip_rounding)

    @property
    def axis_point_tolerance(self) -> float:
        """What curves may use at the axis point: `axis_point_allowed` less the rounding of tip and axis point."""
        return self.curve_share * (self.axis_point_allowed - self._axis_point_rounding)

    @property
    def common_tolerance(self) -> float:
        """What curves may use at the tip and at `axis_scale` from it, where both are measured with one limit, mm."""
        axis = self._axis_point_rounding
        if self.axis_tolerance is not None:
            axis = (self._tip_rounding + axis) / self.axis_length * self.axis_scale
        return self.curve_share * (self.tolerance - max(self._tip_rounding, axis))

    @property
    def line_tolerances(self) -> tuple[float, float]:
        """What long lines may use at the tip and at the axis point, mm."""
        return (
            self.line_share * (self.tolerance - self._tip_rounding),
            self.line_share * (self.axis_point_allowed - self._axis_point_rounding),
        )

    @property
    def _tip_rounding(self) -> float:
        return math.sqrt(3) / 2 * self.tip_resolution + self.pose_shift

    @property
    def _axis_point_rounding(self) -> float:
        return math.sqrt(3) / 2 * (self.tip_resolution + self.axis_point_resolution) + self.pose_shift

    @property
    def chord(self) -> float:
        """Effective chord tolerance of dense output, mm."""
        return min(self.tolerance / 10, LARGEST_CHORD) if self.chord_tolerance is None else self.chord_tolerance

    @property
    def interpolation_tolerance(self) -> float:
        """Distance, at `axis_scale` from the tip, that turning the axis inside one written line may add, mm.

        It needs no share of ε in the choice of L: inside a transition it vanishes at the written poses, where the
        deviation has its maximum.
        """
        return 0.1 * self.tolerance

    def but(self, **changes: Any) -> Settings:
        """Return a copy with some values changed.

        Returns
        -------
        Settings
            A new one; this one stays as it is.

        Raises
        ------
        SettingsError
            CS202 and others: a value out of its bounds.
        """
        return replace(self, **changes)


#: What the axis point may be off, over ε, where the axis has a tolerance of its own. The larger, the less the way of
#: the tip takes of what the axis may turn (a tenth of it at most), and the longer is H.
AXIS_POINT_SHARES = 9.0


def chord_of(degrees: float) -> float:
    """Distance of two unit vectors at an angle."""
    return 2.0 * math.sin(math.radians(degrees) / 2.0)


#: Largest default of the chord tolerance, mm. Where lines meet, the axes jump in speed, and a control slows down for
#: it: a larger tolerance must not mean coarser lines. docs/feedrate.md has the times that led to this.
LARGEST_CHORD = 5e-4

#: mm: on a shorter way the tip stands still, and no feed divides lines
STANDING = 1e-9

#: A feed move whose tool axis turns by more (degrees) is refused. Between opposite axes there is no great circle. Near
#: them there is one, but it hangs on the last digits: in the middle of the turn, an error of the axes at both ends is
#: 1/cos(θ/2) times as large, that is 11 times at 170 degrees, 23 times at 175, 57 times at 178 and 1146 times at 179.9.
#: Half a unit of the fourth decimal, which some CL files have, is a tenth of a degree there at 175, and 6 at 179.9.
FLIP_ANGLE = 175.0

#: Poses up to which the time is planned by default: a minute of work.
TIMED_POSES = 20_000

#: closed bounds of the numeric settings
BOUNDS: dict[str, tuple[float, float]] = {
    item.name: item.metadata["bounds"] for item in fields(Settings) if item.metadata["bounds"]
}


@described
@dataclass(frozen=True)
class Limits(OptionFields):
    """Limits of the motion; the defaults are those of the paper's Example 2."""

    feed: float | None = option(None, "Feed of all feed moves instead of the programmed ones.", unit="mm/min")
    accel: float = option(1000.0, "Acceleration along the path.", unit="mm/s2")
    jerk: float = option(5000.0, "Jerk along the path.", unit="mm/s3")
    centripetal: float | None = option(None, "Acceleration across the path.", unit="mm/s2", instead="accel")
    rapid: float = option(10000.0, "Speed of rapid moves.", unit="mm/min")
    rapid_accel: float | None = option(None, "Acceleration of rapids.", unit="mm/s2", instead="accel")
    rapid_jerk: float | None = option(None, "Jerk of rapids.", unit="mm/s3", instead="jerk")
    angular_feed: float = option(30.0, "Speed of moves that only turn the tool axis.", unit="deg/s")
    angular_accel: float = option(150.0, "Their acceleration.", unit="deg/s2")
    angular_jerk: float = option(3000.0, "Their jerk.", unit="deg/s3")
    period: float = option(
        0.002,
        "Interpolation period, as in 2ms: at corners that stay sharp the velocity changes by at most accel times "
        "period. [default: 2ms]",
        unit="s",
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        for item in fields(self):
            value = getattr(self, item.name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise SettingsError("CS260", f"{item.name} is {value:g}", "give a positive number")

    @property
    def centripetal_accel(self) -> float:
        """Limit of κ·v², mm/s²."""
        return float(self._value("centripetal"))

    @property
    def rapid_limits(self) -> tuple[float, float, float]:
        """Speed mm/s, acceleration mm/s² and jerk mm/s³ of rapid moves."""
        return self.rapid / 60.0, self._value("rapid_accel"), self._value("rapid_jerk")

    @property
    def angular_limits(self) -> tuple[float, float, float]:
        """Speed, acceleration and jerk of pure rotations in rad/s, rad/s², rad/s³."""
        return math.radians(self.angular_feed), math.radians(self.angular_accel), math.radians(self.angular_jerk)
