"""How closely a motion is planned."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Resolution:
    """How fine intervals and cells are, and how near to the fastest profile a plan comes."""

    part: float = 0.07  #: length of a cell at a change of the speed limit, over v·√(v/J)
    growth: float = 0.12  #: growth of the cells per length
    end: float = 0.7  #: length of the cell next to a stop, over the way covered while the jerk is constant there
    fewest: int = 40  #: cells in a run at least
    #: intervals of a curve to begin with, and of a line or arc
    curve: int = 4
    line: int = 2
    #: an interval is halved where the middle of a derivative misses the mean of its ends by more than this part of a
    #: limit, and where the part of a limit of speed that is used at one speed varies so much
    even: float = 0.02
    varied: float = 0.05
    #: rounds of holding more quantities; after the last what is still beyond a limit is slowed down, but in no round
    rounds: int = 6
    gap: float = 2e-4  #: remaining duality gap over the time at which a profile is taken, and that of the first one
    rough: float = 0.05


PLAIN = Resolution()
#: where more is limited than the way itself
FINER = Resolution(part=0.03, growth=0.1)
# coarse cells, and one round
ROUGHLY = Resolution(0.2, 0.8, fewest=10, curve=2, line=1, even=0.1, varied=0.25, rounds=0, gap=5e-3, rough=0.2)
