"""Which writer writes a pose: that of a tool that tilts, of one that stays along Z, or of a tilted plane."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from cornersmooth.model import Bools
from cornersmooth.nc.block_writer import BlockWriter
from cornersmooth.nc.cycle_blocks import upright_form
from cornersmooth.nc.form import Form
from cornersmooth.nc.planes import Planes


@dataclass
class Writers:
    """The writers of a text.

    Parameters
    ----------
    tilting : BlockWriter
        For tools under tool tip control.
    upright : (n,) bool
        `cycle_blocks.upright_poses`.
    planes : Planes
    """

    tilting: BlockWriter
    upright: Bools
    planes: Planes
    _upright: BlockWriter | None = field(init=False)
    _planes: list[BlockWriter] = field(init=False)
    _tools: dict[int | None, BlockWriter] = field(default_factory=dict)  #: for tools of different lengths

    def __post_init__(self) -> None:
        form = self.tilting.form
        self._upright = self._without_axis(upright_form(form)) if self.upright.any() else None
        self._planes = [replace(self._without_axis(plane_form(form)), plane=plane) for plane in self.planes.planes]

    def _without_axis(self, form: Form) -> BlockWriter:
        return replace(self.tilting, form=form, stretch=form.stretch(1.0), blend="")

    def of(self, pose: int, tool: int | None) -> BlockWriter:
        """Writer of a pose, and of the tool at hand."""
        plane = int(self.planes.of[pose])
        if plane >= 0:
            return self._planes[plane]
        return self._upright if self._upright is not None and self.upright[pose] else self._of_tool(tool)

    def plane_of(self, pose: int) -> int:
        """Number of the tilted plane of a pose, -1 for none."""
        return int(self.planes.of[pose])

    def _of_tool(self, tool: int | None) -> BlockWriter:
        """Writer for a tool that tilts: of its own where its length goes into every position."""
        machine = self.tilting.form.machine
        if machine is None or not machine.tool_lengths or self.tilting.form.orientation != "machine":
            return self.tilting
        if tool not in self._tools:
            form = replace(self.tilting.form, machine=machine.with_tool(tool))
            self._tools[tool] = replace(self.tilting, form=form, blocks=0)
        return self._tools[tool]

    def takes_cycles(self, writer: BlockWriter) -> bool:
        """Whether a writer's tool runs as the cycles of the control want it: along Z, or along Z' of a plane."""
        return writer is self._upright or writer.plane is not None

    def all(self) -> Iterator[BlockWriter]:
        """Give every writer once."""
        yield from (self.tilting, *self._tools.values(), *self._planes)
        if self._upright is not None:
            yield self._upright


def plane_form(form: Form) -> Form:
    """Return the form of a tool in a tilted plane, without words of its axis."""
    assert form.plane is not None
    return replace(form, orientation="fixed", mode=form.plane)
