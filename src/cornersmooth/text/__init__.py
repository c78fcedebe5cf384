"""Fast numbers both ways: text to float64 and float64 to text.

The only place where a number is rounded for output.
"""

from cornersmooth.text.parse import parse_numbers
from cornersmooth.text.rows import RowFormat, interleave
from cornersmooth.text.ticks import format_number, to_ticks

__all__ = ["RowFormat", "format_number", "interleave", "parse_numbers", "to_ticks"]
