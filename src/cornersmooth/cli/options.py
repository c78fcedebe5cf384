"""What the options of a command mean: control, machine, form, settings, limits, the input and how it is read.

What the head of a program says of how it was made counts in place of options that were not typed.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import click

from cornersmooth.cli.declared import FLAGS, LIMITS, PLANNED, PLANNED_ALONE, Declared
from cornersmooth.cli.files import read_head, read_input
from cornersmooth.errors import SettingsError
from cornersmooth.frame import read_provenance, weights_word

if TYPE_CHECKING:
    from cornersmooth.kinematics import Machine
    from cornersmooth.nc import Control, Form
    from cornersmooth.nc_reader import Problem
    from cornersmooth.settings import Limits, Settings

#: arguments of `cornersmooth.read` that options give
_ARGUMENTS = (
    "dialect units arc_rule operation lenient tool_number spindle scale flip_axis between_passes cycle_order".split()
)

#: the dialect of a table of points
POINTS = "points"


class Options(Declared):
    """Arguments and options, and what they stand for."""

    def load_control(self) -> Control:
        """Control of that name, of that file, or of the shop settings."""
        from cornersmooth.nc import load_control

        control: str | Control = self.control
        return load_control(control) if isinstance(control, str) else control

    def load_machine(self) -> Machine | None:
        """Machine of that name, of that file, or of the shop settings; None where none is named."""
        return _machine(self.machine)

    def load_limits(self) -> Machine | None:
        """Machine whose limits count, in place of those of the machine of the words."""
        return _machine(self.limits)

    def choose_form(self) -> Form:
        """Form of the control that the options ask for."""
        from cornersmooth.nc import choose_form

        with _named_as_typed():
            return choose_form(
                self.load_control(),
                self.form,
                machine=self.load_machine(),
                tcp=not self.no_tcp,
                extras=self.extras,
                digits=self.digits,
                rewind=self.rewind or 0.0,
                planes=self.planes == "tilted",
            )

    def settings(self) -> Settings:
        """How to smooth; options that a command does not have keep their defaults."""
        from cornersmooth.settings import Settings

        self.check_axis()
        names = (item.name for item in fields(Settings) if hasattr(self, item.name))
        with _named_as_typed():
            return Settings(**{name: getattr(self, name) for name in names})

    def check_axis(self) -> None:
        """Refuse a length and a tolerance of the axis in one command: the one takes the place of the other."""
        if self.axis_tolerance is not None and typed("axis_length") and typed("axis_tolerance"):
            raise click.UsageError("--axis-tolerance takes the place of -H/--axis-length: give one of them")

    def path_limits(self, names: str = LIMITS) -> Limits:
        """What the machine can do."""
        from cornersmooth.feedrate import Limits

        with _named_as_typed():
            return Limits(**{name: getattr(self, name) for name in names.split()})

    def planned_limits(self) -> Limits | None:
        """Limits of the plan whose feeds are written; None where they are the programmed ones (and UsageError)."""
        if self.feed_from_plan:
            return self.path_limits(f"{PLANNED} {PLANNED_ALONE}")
        for name in filter(typed, PLANNED.split()):
            raise click.UsageError(f"--{name} is for --feed-from-plan")
        return None

    def reading(self) -> dict[str, Any]:
        """Keyword arguments of `cornersmooth.read`."""
        more: dict[str, Any] = {"size_limit": not self.no_size_limit, "machine": self.load_machine()}
        if self.dialect == POINTS:
            more |= {"format": POINTS, "dialect": None}
        return {name: getattr(self, name) for name in _ARGUMENTS} | more

    def read(self) -> tuple[bytes, str, bool]:
        """Contents and name of the input, and whether it is an NC program; options of the other kind are refused."""
        from cornersmooth.frame import HEAD
        from cornersmooth.nc_reader.recognition import first_block

        data, name = read_input(self.source, size_limit=not self.no_size_limit)
        program = first_block(data[:HEAD]) is not None
        for param in click.get_current_context().command.params:
            option = str(param.name)
            if not typed(option) or not getattr(self, option):
                continue
            if program and option in {"feed", *_ARGUMENTS} - {"units"}:
                what = f"{param.opts[-1]} is for CL files, and the input is an NC program; leave it out"
                raise click.UsageError(what)
            if not program and option == "tip_control":
                raise click.UsageError("--tip-control is for NC programs, and the input is a CL file; leave it out")
        return data, name, program

    def reading_back(self) -> dict[str, Any]:
        """Keyword arguments of `nc_reader.read_nc` for a program that somebody wrote (SettingsError CS204)."""
        from cornersmooth.nc_reader import CONTROLS

        control = self.load_control()
        if control.dialect not in CONTROLS:
            raise SettingsError(
                "CS204", f"{control.name} is like no control that can be read", 'say like = "fanuc" or another in it'
            )
        return {"control": control.dialect, "machine": self.load_machine(), "tcp": not self.no_tcp}


def _machine(machine: Any) -> Machine | None:
    from cornersmooth.kinematics import load_machine

    return load_machine(machine) if isinstance(machine, str) and machine else machine or None


@contextlib.contextmanager
def _named_as_typed() -> Iterator[None]:
    """Errors about a value name its option; those of the library name its field."""
    try:
        yield
    except SettingsError as wrong:
        field_name, verb, rest = wrong.what.partition(" is ")
        if wrong.code in ("CS202", "CS260"):
            field_name = FLAGS.get(field_name, [field_name])[-1]
        raise SettingsError(
            wrong.code, field_name + verb + rest, wrong.hint, file=wrong.file, line=wrong.line
        ) from None


def typed(name: str) -> bool:
    """Whether an option of the command that runs was given on the command line."""
    context = click.get_current_context(silent=True)
    return context is not None and context.get_parameter_source(name) == click.core.ParameterSource.COMMANDLINE


#: share by which numbers may differ that are alike
_ALIKE = 1e-9


@dataclass(frozen=True)
class Head:
    """What was taken from the head of a program."""

    given: Options  #: with what took the place of options that were not typed
    taken: tuple[str, ...] = ()  #: the words of it
    loose: tuple[str, ...] = ()  #: what is not verified because the program itself loosens the check
    weights: tuple[float, ...] | None = None  #: Weights of its curves; None for any.
    form: str | None = None  #: In which it was written; None where it does not say.
    remark: str = ""  #: what is strange about it; empty for nothing
    problem: Problem | None = None


def take_head(given: Options, nc: bytes | str | os.PathLike[str], source: bytes) -> Head:
    """Take what the head of a program says of how it was made for options that were not typed."""
    from cornersmooth.kinematics import machine_names
    from cornersmooth.nc import control_names
    from cornersmooth.nc_reader import Problem

    head = read_head(nc)
    made = read_provenance(head)
    if made is None:
        return recognised(given, head)
    words: dict[str, tuple[str, Any]] = {"tolerance": ("E", made.tolerance), "axis_length": ("H", made.axis_length)}
    if not typed("axis_length"):
        words["axis_tolerance"] = ("AXIS", made.axis_tolerance)
    words |= {"control": ("CONTROL", made.control)} if made.control in control_names() else {}
    words |= {"machine": ("MACHINE", made.machine or None)} if made.machine in ("", *machine_names()) else {}
    words |= {"operation": ("OPERATION", str(made.operation))} if made.operation else {}
    words |= {"no_tcp": ("TCP", not made.tcp), "slower": ("FEEDS", made.planned_feeds)}
    words |= {"work_offset": ("OFFSET", "none")} if made.work_offset == "none" else {}
    words = {name: word for name, word in words.items() if not typed(name)}
    if "axis_length" in words and (typed("axis_tolerance") or made.axis_tolerance is not None):
        del words["axis_length"]  # H is no measure where the axis has a tolerance of its own
    now = replace(given, **{name: value for name, (_, value) in words.items()})
    if made.machine and not now.machine:
        raise SettingsError("CS225", f"the program is for the machine {made.machine}", "name its file with --machine")
    spelled = {"machine": made.machine, "no_tcp": "no", "slower": "plan"}
    taken = [
        f"{word}={spelled.get(name, f'{value:.9g}' if isinstance(value, float) else value)}"
        for name, (word, value) in words.items()
        if value not in (None, False)
    ]
    taken += [f"WEIGHTS={word}" for word in [weights_word(made.weights)] if word]
    problem = None
    if made.sha256 and made.sha256 != hashlib.sha256(source).hexdigest():
        text = "the program was made from another CL file, or that has changed since: its SHA-256 is another"
        problem = Problem("CS567", 0, 1, text)
    return Head(now, tuple(taken), tuple(_loose(given, now, set(words))), made.weights, made.form, problem=problem)


def _loose(before: Options, given: Options, taken: set[str]) -> Iterator[str]:
    """Say where words of the head make the check looser than the options and settings do without them."""
    from cornersmooth.verify.task import length_of

    def lever(options: Options) -> float:
        """Distance from the tip at which the axis is off by the tolerance where it is off by what it may."""
        own = options.axis_tolerance
        return float(options.axis_length if own is None else length_of(options.tolerance, own))

    was, now = before.tolerance, given.tolerance
    if "tolerance" in taken and now > was * (1.0 + _ALIKE):
        yield f"the tolerance {now:g} mm is the program's own word, looser than {was:g} mm: name it with -e"
    looser = lever(given) < lever(before) * (1.0 - _ALIKE) and now / lever(given) > was / lever(before) * (1.0 + _ALIKE)
    if looser and taken & {"axis_length", "axis_tolerance"}:
        name = "-H" if given.axis_tolerance is None else "--axis-tolerance"
        yield f"the tolerance of the tool axis is the program's own word, looser than without: name it with {name}"
    if "operation" in taken:
        yield f"that operation {given.operation} is enough is the program's own word: name it with --operation"
    if "slower" in taken and given.slower:
        yield "feeds: that they may be lower is the program's own word: name it with --planned-feeds"
    if "work_offset" in taken:
        yield "that no work offset is selected is the program's own word: name it with --work-offset none"


def recognised(given: Options, head: bytes) -> Head:
    """Take the control that a program looks like, where none was named, and say so."""
    from cornersmooth.nc_reader.recognition import recognise_control

    looks = recognise_control(head)
    source = click.get_current_context().get_parameter_source("control")
    named = source != click.core.ParameterSource.DEFAULT
    if looks in ("", given.load_control().dialect) or (named and looks == "fanuc"):  # others say its words, too
        return Head(given)
    advice = f"it looks like {looks.capitalize()}: --control {looks}"
    return Head(given, remark=advice) if named else Head(replace(given, control=looks), remark=f"{advice} is taken")
