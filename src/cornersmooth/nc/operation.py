"""What begins and what ends the motion of a tool, and the program: the steps of the control's table.

`ProgramTable` says which steps and blocks follow one another; this module knows what each step is at the moment. A step
whose state is reached already is no block: the tool is retracted once, and the spindle is stopped where it turns.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

from cornersmooth.kinematics.machine import LINEAR
from cornersmooth.model import MM_PER_UNIT, Units
from cornersmooth.nc.control import STEPS, Blocks, Mode
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.form import Form
from cornersmooth.text import format_number

#: blocks of the steps `rotary_zero` and `rotary_start`; nothing without rotary axes
RotaryBlocks = Mapping[str, Blocks]

_NO_ROTARY: RotaryBlocks = {}

#: what of `tool_end` is not done where the tool only goes home
_RUNNING_ON = ("{spindle_off}", "{coolant_off}")


@dataclass
class Operation:
    """Writes the blocks around the motion of each tool and remembers what is on."""

    form: Form
    values: Mapping[str, str]  #: what stands for braces in blocks
    texts: Mapping[str, Blocks]  #: blocks of the steps that a user gives: ``work_offset``, ``header``, ``footer``
    findings: Findings
    offset: int = 1  #: length register
    retracted: bool = False  #: the next motion comes from the height of the retract
    #: blocks that turn the spindle and let the coolant flow; none while it stands, or does not flow
    on: dict[str, Blocks] = field(default_factory=lambda: {"spindle": (), "coolant": ()})
    begun: bool = False  #: the blocks of `begin` hold
    withdraw: Callable[[], list[str]] = list  #: blocks along the tool before a retract, of who knows where it is
    halted: bool = False  #: the CL file has stopped the program since the last motion
    clamps: tuple[tuple[str, str], ...] = ()  #: words that hold rotary axes, and let them turn
    units: Units = "mm"  #: of the text
    plane: Mapping[str, str] = field(default_factory=dict)  #: numbers of the tilted plane at hand
    mode: Mode = field(init=False)  #: what tool tip control is for the tool at hand
    _with_z: str = ""  # words that wait for the first block that moves Z
    _clamped: bool = True  # the state before is not known
    _tip_control: bool = False
    _functions: bool = False
    _moved: bool = False  # the tool has been used since it was up
    _used: bool = False  # the tool has been used
    _halted: set[str] = field(default_factory=set)  # what a stop has switched off, until it is switched on again
    _stopped: dict[str, Blocks] = field(default_factory=dict)  # what a tool change has switched off, as it was on
    _stopped_line: int = 0

    def __post_init__(self) -> None:
        self.mode = self.form.mode
        if self.form.machine is not None and self.form.rotary:
            self.clamps = tuple(axis.clamp for axis in self.form.machine.axes if axis.clamp is not None)

    def start(self) -> list[str]:
        """Blocks before everything else."""
        return self._expand(self.form.table.program.start)

    def begin(self, rotary: RotaryBlocks = _NO_ROTARY) -> list[str]:
        """Blocks before the next motion of a tool; what a tool change stopped goes on again."""
        self._moved = self._used = self.begun = True
        blocks = [block for what in self.on for block in self._stopped.get(what, ())]
        if self._stopped:
            what = " and ".join(self._stopped)
            text = f"{what} not given again in translated words after a tool change: on as before"
            self.findings.add("CS331", "warning", self._stopped_line, text)
        self.on |= self._stopped
        self._halted -= self._stopped.keys()
        self._stopped = {}
        steps = self.form.table.program.begin if self.mode.begin is None else self.mode.begin
        blocks += [*self._let_turn(), *self._expand(steps, rotary if self.retracted else _NO_ROTARY)]
        return blocks + (self._hold() if self.mode in (self.form.upright, self.form.plane) else [])

    @property
    def turning(self) -> bool:
        """Whether the spindle turns at the next motion: it does, or goes on after a tool change."""
        return bool(self.on["spindle"] or self._stopped.get("spindle"))

    @property
    def _tool_end(self) -> Blocks:
        """Steps after the last motion of a tool, or of a tilted plane."""
        return self.form.table.program.tool_end if self.mode.tool_end is None else self.mode.tool_end

    def _let_turn(self) -> list[str]:
        """Blocks that let clamped rotary axes turn."""
        clamped, self._clamped = self._clamped, False
        return [turn for _, turn in self.clamps] if clamped else []

    def _hold(self) -> list[str]:
        """Blocks that clamp the rotary axes."""
        self._clamped = True
        return [hold for hold, _ in self.clamps]

    def end_tool(self, line: int = 0, *, another: bool = False) -> list[str]:
        """Blocks after the last motion of a tool, which a statement at a line asks for; `another` tool may follow."""
        self._stopped_line, self.begun = line, False
        steps = self._tool_end
        if not self._moved:  # a program begins with a tool change, as a rule
            steps = tuple(step for step in steps if step in _STEPS)
        if self._used and another and not self.halted:
            steps = (*steps, *self.form.table.program.between_tools)
        self._moved = self._used = False
        return [*self._back(), *self._expand(steps)]

    def go_home(self, *, along: bool = True) -> list[str]:
        """Blocks that bring the tool to the height of the retract with spindle and coolant on.

        `along`: it may have to go back along its axis first.
        """
        self._moved = self.begun = False
        return [
            *(self._back() if along else ()),
            *self._expand([step for step in self._tool_end if step in _STEPS.keys() - _RUNNING_ON]),
        ]

    def _back(self) -> list[str]:
        """Blocks along the tool, where it is not high up anyway."""
        return self.withdraw() if self._tip_control and not self.retracted else []

    @property
    def comes_first(self) -> bool:
        """Whether the next motion is the first after a retract, or of a tool where there is none."""
        return self.retracted or not (self.begun or self.can_rewind())

    def can_rewind(self) -> bool:
        """Whether there is a retract, above which rotary axes may turn as they like."""
        return bool(self.form.table.program.retract)

    def pause(self) -> list[str]:
        """Blocks that switch tool tip control off where the tool stands, for words that it does not allow.

        A tilted plane ends above the part only.
        """
        if self._tip_control and self.mode is self.form.plane:
            return self.go_home()
        return self._expand(("{functions_off}", "{tip_control_off}"))

    def end(self, rotary: RotaryBlocks = _NO_ROTARY) -> list[str]:
        """Blocks after everything else."""
        steps, blocks = self.form.table.program.end, self.end_tool()
        position = self._own_position("home")
        home = self._to_position({name: value for name, value in position.items() if name != "Z"})
        zero = rotary.get("rotary_zero", ())
        if any(name not in LINEAR for name in position):  # they stand there, and are held
            zero = ()
        elif zero and "{rotary_zero}" in steps:
            zero = (*self._let_turn(), *zero, *self._hold())
        elif not self._clamped:
            blocks += self._hold()
        return [*blocks, *home, *self._expand(steps, {**rotary, "rotary_zero": zero})]

    def switch(self, what: str, blocks: Blocks) -> None:
        """Take note of the blocks that turn the spindle or let the coolant flow, or of none where it stops."""
        self.on[what] = blocks
        self._stopped.pop(what, None)
        self._halted.discard(what)

    def halt(self) -> None:
        """Take note of a stop: most controls stop spindle and coolant with it, and start neither again."""
        self.halted, self._halted = True, set(self.on)

    def go_on(self) -> list[str]:
        """Blocks before the first motion after a stop: spindle and coolant as they were."""
        again = {"spindle": self.on["spindle"][-1:], "coolant": self.on["coolant"]}
        halted, self._halted = self._halted, set()
        return [block for what, blocks in again.items() if what in halted for block in blocks]

    def later(self, what: str, blocks: Blocks) -> list[str]:
        """Let blocks that turn the spindle, or let the coolant flow, wait for a tool change ahead of any motion."""
        self._stopped[what] = blocks
        return []

    def coolant_end(self) -> Blocks:
        """Blocks that stop the coolant that flows."""
        words, on = self.form.table.words, self.on["coolant"]
        own = [off for kind, off in words.coolant_off.items() if on and words.coolant.get(kind) == on]
        return own[0] if own else words.coolant.get("OFF", ())

    def coolant_before(self, blocks: Blocks) -> Blocks:
        """Blocks before those of another kind of coolant: where one of both has its own end, the other would go on."""
        words, on = self.form.table.words, self.on["coolant"]
        own = {words.coolant.get(kind) for kind in words.coolant_off}
        return self.coolant_end() if on not in ((), blocks) and {on, blocks} & own else ()

    def _expand(self, steps: Sequence[str], rotary: RotaryBlocks = _NO_ROTARY) -> list[str]:
        """Blocks of steps; what is no step is a block itself."""
        given, blocks = {**self.texts, **rotary}, list[str]()
        for step in steps:
            name = step.strip("{}")
            if step in _STEPS:
                blocks += _STEPS[step](self)
            elif name in STEPS and name != step:
                blocks += given.get(name, ())
            else:
                blocks.append(step.format(**self.values))
        return blocks

    def change_position(self) -> list[str]:
        """Blocks that bring the axes to where tools are changed, after a retract."""
        position = self._own_position("tool_change")
        high = {"Z": position.pop("Z")} if "Z" in position else {}
        return [*self._to_position(position), *self._to_position(high)]

    def _own_position(self, key: str) -> dict[str, float]:
        """Position that the machine's file has, where the control has words for it."""
        machine = self.form.machine
        return dict(getattr(machine, key)) if machine is not None and self.form.table.program.position else {}

    def _to_position(self, position: Mapping[str, float]) -> list[str]:
        """Block that sends axes to a position of the machine; rotary ones are let turn, and held again."""
        if not position:
            return []
        table, motion = self.form.table, self.form.mode.motion
        words = []
        for name, value in position.items():
            linear = name in LINEAR
            decimals = table.digits.mm if linear and self.units == "mm" else table.digits.inch
            unit = MM_PER_UNIT[self.units] if linear else 1.0
            text = format_number(value / unit, decimals if linear else table.digits.angle, trim=True)
            text = text if motion.feed_point else text.rstrip(".")
            words.append(f"{name}{'+' if motion.signs and not text.startswith('-') else ''}{text}")
        block = table.program.position.format(position=" ".join(words))
        turning = any(name not in LINEAR for name in position)
        return [*(self._let_turn() if turning else ()), block, *(self._hold() if turning else ())]

    def _retract(self) -> list[str]:
        there, self.retracted = self.retracted, bool(self.form.table.program.retract)
        if there:
            return []
        home = self._own_position("home")
        if "Z" in home:
            return self._to_position({"Z": home["Z"]})
        return [block.format(**self.values) for block in self.form.table.program.retract]

    def _tip_control_on(self) -> list[str]:
        self._tip_control = self._functions = True
        on = [block.format(offset=self.offset, **self.plane) for block in self.mode.on]
        within = [*self._expand(self.mode.within_on), *self._extras("on", outside=False)]
        if self.mode.on[-1:] == (self.mode.motion.with_z,) and not within:  # functions within want it before them
            self._with_z = on.pop()
        return [*self._extras("on", outside=True), *on, *within]

    def take_with_z(self) -> str:
        """Words that stand in the first block that moves Z, once; empty where there are none."""
        words, self._with_z = self._with_z, ""
        return words

    def _functions_off(self) -> list[str]:
        if not self._functions:
            return []
        self._functions = False
        return [*self._extras("off", outside=False), *self._expand(self.mode.within_off)]

    def _tip_control_off(self) -> list[str]:
        self.begun = False
        if not self._tip_control:
            return []
        self._tip_control, self._with_z = False, ""
        return [*self._functions_off(), *self.mode.off, *self._extras("off", outside=True)]

    def _extras(self, side: str, *, outside: bool) -> list[str]:
        extras = self.form.extras if side == "on" else self.form.extras[::-1]
        return [
            block.format(**self.values)
            for extra in extras
            if extra.outside is outside
            for block in getattr(extra, side)
        ]

    def _stop(self, what: str, blocks: Blocks) -> list[str]:
        if not self.on[what]:
            return []
        self._stopped[what], self.on[what] = self.on[what], ()
        return list(blocks)


_STEPS: Mapping[str, Callable[[Operation], list[str]]] = {
    "{retract}": Operation._retract,
    "{tip_control_on}": Operation._tip_control_on,
    "{functions_off}": Operation._functions_off,
    "{tip_control_off}": Operation._tip_control_off,
    "{spindle_off}": lambda operation: operation._stop("spindle", operation.form.table.words.spindle_off),
    "{coolant_off}": lambda operation: operation._stop("coolant", operation.coolant_end()),
}
