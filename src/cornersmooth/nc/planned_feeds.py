"""The feeds that a plan reaches, put into the blocks of a text: for controls that do not look ahead themselves."""

from __future__ import annotations

import re
from typing import Final

import numpy as np

from cornersmooth.model import Floats, Ints, Program
from cornersmooth.nc.control import INVERSE_TIME
from cornersmooth.nc.form import Form
from cornersmooth.nc.rotary_rows import INVERSE_TIME_DECIMALS
from cornersmooth.text import format_number

#: figures of a planned feed: the fifth changes the time of a block by less than 0.1 %
_FIGURES: Final = 4
_ALL_BUT: Final = 0.999  #: part of the programmed feed from which on it is that one: fewer words, 0.1 % of the time
_FEED: Final = re.compile(rb" ?F(\d+\.?\d*|\.\d+)$")  #: feed word at the end of a line, with its number


def with_planned_feeds(
    text: bytes, form: Form, program: Program, line: Ints, feed: Floats, minutes: Floats, programmed: Floats
) -> bytes:
    """Return the text with a feed word wherever the feed changes, none above the programmed one.

    Of b blocks, by their NC lines, which ascend: the feed of the plan, mm/min, NaN where it says none, as where the tip
    stands still; what the block takes, more than nothing, over which those under inverse time (G93) get one; and the
    programmed feed, mm/min, which holds where the plan says none.
    """
    motion, digits = form.mode, form.table.digits
    scale = 10.0**digits.feed
    unit = (motion.inch_feed if program.units == "inch" else 1) / program.mm_per_unit
    given = np.rint(programmed * unit * scale)
    planned = np.fmin(feed, programmed) * unit * scale
    # not more figures than say anything, rounded down
    step = np.maximum(10.0 ** np.floor(np.log10(np.maximum(planned, 1.0)) - _FIGURES + 1), 1.0)
    planned = np.where(planned >= _ALL_BUT * given, given, np.maximum(np.floor(planned / step) * step, 1.0))
    ticks = np.where(np.isnan(feed), given, planned)
    rate = np.floor(10.0**INVERSE_TIME_DECIMALS / minutes)
    end = b"\r\n" if b"\r\n" in text else b"\n"
    lines = text.split(end)
    word = (" " if motion.spaces else "") + motion.feed

    def feed_word(value: float, decimals: int) -> bytes:
        number = format_number(value / 10.0**decimals, decimals, trim=True)
        return (word + (number if motion.feed_point else number.rstrip("."))).encode()

    modes = {block.encode(): key for key, block in form.table.words.feed_mode.items()}
    row, goes_on = {int(one) - 1: k for k, one in enumerate(line)}, form.table.layout.continuation.encode()
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
