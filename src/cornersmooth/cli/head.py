"""What the head of a program says of how it was made, in place of options that were not typed."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import click

from cornersmooth.cli.files import read_head
from cornersmooth.cli.options import Options, typed
from cornersmooth.errors import SettingsError
from cornersmooth.frame import read_provenance, weights_word
from cornersmooth.kinematics import machine_names
from cornersmooth.nc import control_names
from cornersmooth.nc_reader import Problem
from cornersmooth.nc_reader.recognition import recognise_control
from cornersmooth.verify.task import length_of

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
    looks = recognise_control(head)
    source = click.get_current_context().get_parameter_source("control")
    named = source != click.core.ParameterSource.DEFAULT
    if looks in ("", given.load_control().dialect) or (named and looks == "fanuc"):  # others say its words, too
        return Head(given)
    advice = f"it looks like {looks.capitalize()}: --control {looks}"
    return Head(given, remark=advice) if named else Head(replace(given, control=looks), remark=f"{advice} is taken")
