"""The feeds that a plan reaches, put into the blocks of a text: for controls that do not look ahead themselves."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints, Units
from cornersmooth.nc.control import INVERSE_TIME
from cornersmooth.nc.form import Form
from cornersmooth.nc.rotary_rows import INVERSE_TIME_DECIMALS
from cornersmooth.text import format_number

#: figures of a planned feed: the fifth changes the time of a block by less than 0.1 %
_FIGURES: Final = 4
_ALL_BUT: Final = 0.999  #: part of the programmed feed from which on it is that one: fewer words, 0.1 % of the time
_FEED: Final = re.compile(rb" ?F(\d+\.?\d*|\.\d+)$")  #: feed word at the end of a line, with its number


@dataclass(frozen=True)
class PlannedFeeds:
    """Feeds of a plan for the blocks of a text, b of them."""

    line: Ints  #: (b,) NC lines, ascending
    feed: Floats  #: (b,), mm/min; NaN where the plan says none, as where the tip stands still
    minutes: Floats  #: (b,) what a block takes, more than nothing, for inverse time
    programmed: Floats  #: (b,), mm/min; what the feed may not exceed; the feed where the plan says none

    def write(self, text: bytes, form: Form, units: Units, mm_per_unit: float) -> bytes:
        """Return the text with a feed word wherever the feed changes, none above the programmed one.

        Blocks under inverse time (G93) get one over the minutes that they take.
        """
        motion, digits = form.mode.motion, form.table.digits
        scale = 10.0**digits.feed
        unit = (motion.inch_feed if units == "inch" else 1) / mm_per_unit
        given = np.rint(self.programmed * unit * scale)
        planned = np.fmin(self.feed, self.programmed) * unit * scale
        # not more figures than say anything, rounded down
        step = np.maximum(10.0 ** np.floor(np.log10(np.maximum(planned, 1.0)) - _FIGURES + 1), 1.0)
        planned = np.where(planned >= _ALL_BUT * given, given, np.maximum(np.floor(planned / step) * step, 1.0))
        ticks = np.where(np.isnan(self.feed), given, planned)
        rate = np.floor(10.0**INVERSE_TIME_DECIMALS / self.minutes)
        end = b"\r\n" if b"\r\n" in text else b"\n"
        lines = text.split(end)
        word = (" " if motion.spaces else "") + motion.feed

        def feed_word(value: float, decimals: int) -> bytes:
            number = format_number(value / 10.0**decimals, decimals, trim=True)
            return (word + (number if motion.feed_point else number.rstrip("."))).encode()

        modes = {block.encode(): key for key, block in form.table.words.feed_mode.items()}
        row, goes_on = {int(line) - 1: k for k, line in enumerate(self.line)}, form.table.layout.continuation.encode()
        timed, current = False, b""
        for place, block in enumerate(text.split(end)):
            if block in modes:
                timed, current = modes[block] == INVERSE_TIME, b""
            elif place in row:
                last, k = place, row[place]
                while goes_on and lines[last].endswith(goes_on):
                    last += 1
                old = _FEED.search(lines[last])
                bare = lines[last][: old.start()] if old else lines[last]
                if timed:
                    known = float(old[1]) * 10.0**INVERSE_TIME_DECIMALS if old else np.inf
                    new = feed_word(max(min(float(rate[k]), known), 1.0), INVERSE_TIME_DECIMALS)
                else:
                    new = feed_word(float(ticks[k]), digits.feed)
                lines[last] = bare if new == current else bare + new
                current = b"" if timed else new
            elif b"F" in block and _FEED.search(block):
                current = b""  # another feed since the last block
        return end.join(lines)
