"""What a control remembers: groups with one value each, the blocks that make a value hold, the steps around a tool.

A group that has a value already takes no block. `ProgramTable` says which steps and blocks follow one another.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from cornersmooth.geometry.arcs import FIRST_PLANE
from cornersmooth.kinematics.machine import LINEAR
from cornersmooth.model import MM_PER_UNIT, FeedMode, Units
from cornersmooth.nc.control import STEPS, Blocks, Mode
from cornersmooth.nc.form import Form
from cornersmooth.nc.messages import Findings
from cornersmooth.nc.program_frame import BLEND_STEP, blend_word
from cornersmooth.text import format_number

#: blocks of the steps `rotary_zero` and `rotary_start`; nothing without rotary axes
RotaryBlocks = Mapping[str, Blocks]
_NO_ROTARY: RotaryBlocks = {}
#: steps that change groups, and those of them that a tool leaves as they are where it only goes home
_STEPS: dict[str, tuple[str, Any]] = {
    "{retract}": ("high", True),
    "{tip_control_on}": ("tip", True),
    "{tip_control_off}": ("tip", False),
    "{functions_off}": ("functions", False),
    "{spindle_off}": ("spindle", ()),
    "{coolant_off}": ("coolant", ()),
}
_RUNNING_ON = {"{spindle_off}", "{coolant_off}"}


@dataclass
class Modals:
    """The groups of a control, and what waits for the next motion."""

    form: Form
    values: Mapping[str, str]  #: what stands for braces in blocks
    texts: Mapping[str, Blocks]  #: blocks of the steps that a user gives: ``work_offset``, ``header``, ``footer``
    findings: Findings
    units: Units  #: of the text
    #: group: value. spindle, coolant, compensation: blocks that switched it on, () for off. tip, functions: tool tip
    #: control, and functions within it. high: at the height of the retract. held: rotary axes are clamped. plane: 17 to
    #: 19. feed_mode, feed: kind and key of F. blend: how far corners are rounded. spline: the last block is on one.
    now: dict[str, Any] = field(default_factory=dict)
    mode: Mode = field(init=False)  #: what tool tip control is for the tool at hand
    tilt: Mapping[str, str] = field(default_factory=dict)  #: numbers of the tilted plane at hand
    tool: int | None = None  #: loaded last
    offset: int = 1  #: length register
    speed: float | None = None  #: of the spindle, revolutions per minute
    begun: bool = False  #: the blocks of `begin` hold
    halted: bool = False  #: the CL file has stopped the program since the last motion
    along: Sequence[str] = ()  #: blocks that bring the tool back along its axis where it is, before a retract
    waiting: str = ""  #: words for the first block that moves Z
    clamps: tuple[tuple[str, str], ...] = ()  #: words that hold rotary axes, and let them turn
    _moved: bool = False  # the tool has been used since it was up
    _used: bool = False  # the tool has been used
    _halted: set[str] = field(default_factory=set)  # what a stop has switched off, until it is switched on again
    _stopped: dict[str, Blocks] = field(default_factory=dict)  # what a tool change has switched off, as it was on
    _stopped_line: int = 0

    def __post_init__(self) -> None:
        self.mode = self.form.mode
        if self.form.machine is not None and self.form.rotary:
            self.clamps = tuple(axis.clamp for axis in self.form.machine.axes if axis.clamp is not None)
        self.now |= {"spindle": (), "coolant": (), "compensation": (), "tip": False, "functions": False, "high": False}
        self.now |= {"held": True, "plane": FIRST_PLANE, "feed_mode": int(FeedMode.PER_MINUTE), "feed": -1}
        self.now |= {"blend": 0, "spline": False}

    def __getitem__(self, group: str) -> Any:
        return self.now[group]

    def set(self, **wanted: Any) -> list[str]:
        """Blocks of the groups that change."""
        blocks = []
        for group, value in wanted.items():
            if self.now[group] != value:
                blocks += self.say(group, value)
                self.now[group] = value
        return blocks

    def say(self, group: str, value: Any) -> list[str]:
        """Blocks that make a value of a group hold."""
        table, words = self.form.table, self.form.table.words
        match group, value:
            case "tip", True:
                on = [block.format(offset=self.offset, **self.tilt) for block in self.mode.on]
                within = self.set(functions=True)
                if self.mode.on[-1:] == (self.mode.with_z,) and not within:  # functions within want it before
                    self.waiting = on.pop()
                return [*self._extras("on", outside=True), *on, *within]
            case "tip", False:
                self.waiting = ""
                return [*self.set(functions=False), *self.mode.off, *self._extras("off", outside=True)]
            case "functions", True:
                return [*self.expand(self.mode.within_on), *self._extras("on", outside=False)]
            case "functions", False:
                return [*self._extras("off", outside=False), *self.expand(self.mode.within_off)]
            case "high", True:
                retract = [block.format(**self.values) for block in table.program.retract]
                return self.to_position("home", z=True) or retract
            case "held", _:
                return [hold if value else turn for hold, turn in self.clamps]
            case "spindle" | "coolant", _:
                self._stopped[group] = self.now[group]
                return list(words.spindle_off if group == "spindle" else self.coolant_end())
            case "compensation", _:
                return list(value or words.compensation_off)
            case "plane" | "feed_mode", _:
                block = getattr(words, group).get(value)
                return [] if block is None else [block]
            case "blend", _:
                return [table.lines.rounding.format(blend=blend_word(value * BLEND_STEP))]
        return []

    def _extras(self, side: str, *, outside: bool) -> list[str]:
        extras = self.form.extras if side == "on" else self.form.extras[::-1]
        blocks = (block for extra in extras if extra.outside is outside for block in getattr(extra, side))
        return [block.format(**self.values) for block in blocks]

    def expand(self, steps: Sequence[str], rotary: RotaryBlocks = _NO_ROTARY) -> list[str]:
        """Blocks of steps; what is no step is a block itself."""
        given, blocks = {**self.texts, **rotary}, list[str]()
        for step in steps:
            name = step.strip("{}")
            if step in _STEPS:
                group, value = _STEPS[step]
                blocks += self.set(**{group: value})
                self.now["high"] &= self.can_rewind
            elif name in STEPS and name != step:
                blocks += given.get(name, ())
            else:
                blocks.append(step.format(**self.values))
        return blocks

    def begin(self, rotary: RotaryBlocks) -> list[str]:
        """Blocks before the next motion of a tool; what a tool change stopped goes on again."""
        self._moved = self._used = self.begun = True
        blocks = [block for what in ("spindle", "coolant") for block in self._stopped.get(what, ())]
        if self._stopped:
            self.findings.note("CS331", self._stopped_line, what=" and ".join(self._stopped))
        self.now |= self._stopped
        self._halted -= self._stopped.keys()
        self._stopped = {}
        self.now |= {"tip": False, "functions": False}  # they are given for each tool
        steps = self.form.table.program.begin if self.mode.begin is None else self.mode.begin
        blocks += [*self.set(held=False), *self.expand(steps, rotary if self.now["high"] else _NO_ROTARY)]
        return blocks + (self.set(held=True) if self.mode is not self.form.mode else [])

    @property
    def _tool_end(self) -> Blocks:
        """Steps after the last motion of a tool, or of a tilted plane."""
        return self.form.table.program.tool_end if self.mode.tool_end is None else self.mode.tool_end

    def end_tool(self, line: int = 0, *, another: bool = False) -> list[str]:
        """Blocks after the last motion of a tool, which a statement at a line asks for; `another` tool may follow."""
        self._stopped_line, self.begun = line, False
        steps = self._tool_end if self._moved else tuple(step for step in self._tool_end if step in _STEPS)
        if self._used and another and not self.halted:
            steps = (*steps, *self.form.table.program.between_tools)
        self._moved = self._used = False
        return [*self._back(), *self.set(plane=FIRST_PLANE), *self.expand(steps)]

    def go_home(self, *, along: bool = True) -> list[str]:
        """Blocks that bring the tool to the height of the retract with spindle and coolant on.

        `along`: it may have to go back along its axis first.
        """
        self._moved = self.begun = False
        back = self._back() if along else []
        return [*back, *self.expand([step for step in self._tool_end if step in _STEPS.keys() - _RUNNING_ON])]

    def _back(self) -> list[str]:
        """Blocks along the tool, where it is not high up anyway."""
        return [*self.go_on(), *self.along] if self.along and self.goes_back else []

    @property
    def goes_back(self) -> bool:
        """Whether the tool may have to go back along its axis before it retracts."""
        return bool(self.now["tip"]) and not self.now["high"] and self.can_rewind

    @property
    def comes_first(self) -> bool:
        """Whether the next motion is the first after a retract, or of a tool where there is none."""
        return bool(self.now["high"]) or not (self.begun or self.can_rewind)

    @property
    def can_rewind(self) -> bool:
        """Whether there is a retract, above which rotary axes may turn as they like."""
        return bool(self.form.table.program.retract)

    def pause(self) -> list[str]:
        """Blocks that switch tool tip control off where the tool stands, for words that it does not allow.

        A tilted plane ends above the part only.
        """
        if self.now["tip"] and self.mode is self.form.plane:
            return self.go_home()
        self.begun = False
        return self.expand(("{functions_off}", "{tip_control_off}"))

    def end(self, rotary: RotaryBlocks) -> list[str]:
        """Blocks after everything else."""
        blocks = self.set(feed_mode=int(FeedMode.PER_MINUTE), plane=FIRST_PLANE)
        steps = self.form.table.program.end
        blocks += self.end_tool()
        home, zero = self.to_position("home", z=False), rotary.get("rotary_zero", ())
        if any(name not in LINEAR for name in self._position("home")):  # they stand there, and are clamped
            zero = ()
        elif zero and "{rotary_zero}" in steps:
            zero = (*self.set(held=False), *zero, *self.set(held=True))
        else:
            blocks += self.set(held=True)
        return [*blocks, *home, *self.expand(steps, {**rotary, "rotary_zero": zero})]

    @property
    def turning(self) -> Blocks:
        """Blocks by which the spindle turns at the next motion: it does, or goes on after a tool change."""
        return tuple(self.now["spindle"] or self._stopped.get("spindle", ()))

    def switch(self, what: str, blocks: Blocks) -> None:
        """Take note of the blocks that turn the spindle or let the coolant flow, or of none where it stops."""
        self.now[what] = blocks
        self._stopped.pop(what, None)
        self._halted.discard(what)

    def halt(self) -> None:
        """Take note of a stop: most controls stop spindle and coolant with it, and start neither again."""
        self.halted, self._halted = True, {"spindle", "coolant"}

    def go_on(self) -> list[str]:
        """Blocks before the first motion after a stop: spindle and coolant as they were."""
        again = {"spindle": self.now["spindle"][-1:], "coolant": self.now["coolant"]}
        halted, self._halted = self._halted, set()
        return [block for what, blocks in again.items() if what in halted for block in blocks]

    def later(self, what: str, blocks: Blocks) -> list[str]:
        """Let blocks that turn the spindle, or let the coolant flow, wait for a tool change ahead of any motion."""
        self._stopped[what] = blocks
        return []

    def coolant_end(self) -> Blocks:
        """Blocks that stop the coolant that flows."""
        words, on = self.form.table.words, self.now["coolant"]
        own = [off for kind, off in words.coolant_off.items() if on and words.coolant.get(kind) == on]
        return own[0] if own else words.coolant.get("OFF", ())

    def flow(self, blocks: Blocks, *, off: bool = False) -> list[str]:
        """Let another kind of coolant flow, or switch it `off`; the one before would go on beside it."""
        before = self.coolant_end() if self.now["coolant"] not in ((), blocks) else ()
        self.switch("coolant", () if off else blocks)
        return [*(block for block in before if block not in blocks), *blocks]

    def to_position(self, key: str, *, z: bool) -> list[str]:
        """Block that sends Z, or the other axes, to ``home`` or ``tool_change`` of the machine's file, where it has it.

        Rotary axes are let turn, and clamped again.
        """
        table, motion, words = self.form.table, self.form.mode, []
        position = {name: value for name, value in self._position(key).items() if (name == "Z") is z}
        for name, value in position.items():
            unit = MM_PER_UNIT[self.units] if name in LINEAR else 1.0
            decimals = self.form.tip_decimals(self.units) if name in LINEAR else table.digits.angle
            text = format_number(value / unit, decimals, trim=True)
            text = text if motion.feed_point else text.rstrip(".")
            words.append(f"{name}{'+' if motion.signs and not text.startswith('-') else ''}{text}")
        blocks = [table.program.position.format(position=" ".join(words))] if words else []
        turning = any(name not in LINEAR for name in position)
        return [*self.set(held=False), *blocks, *self.set(held=True)] if turning else blocks

    def _position(self, key: str) -> dict[str, float]:
        """Position that the machine's file has, where the control has words for it."""
        machine = self.form.machine
        return dict(getattr(machine, key)) if machine is not None and self.form.table.program.position else {}
