"""Jerk-limited time laws along the original and the smoothed path."""

from __future__ import annotations

from cornersmooth.feedrate.planner import direct, plan
from cornersmooth.feedrate.timelaw import States, TimeLaw, limiting
from cornersmooth.feedrate.written import BlockLimits, block_feeds, plan_text
from cornersmooth.settings import Limits

__all__ = [
    "BlockLimits",
    "Limits",
    "States",
    "TimeLaw",
    "block_feeds",
    "direct",
    "limiting",
    "plan",
    "plan_text",
]
