"""Smooths the cutting runs of a finished NC program and leaves every other byte.

Shares the reading of blocks with `nc_reader`; smooths and writes by `smoothing` and `nc`::

    bytes -> runs (state known) -> motion (nc_reader) -> smooth, write -> blocks -> both programs read again, compared

================= =====================================================================================================
word              meaning
================= =====================================================================================================
cut               a feed move of the program
run               plain cuts that follow one another in a state that is surely known
state             what a control remembers from block to block; what may have changed is unknown until it comes again
left              cuts that stay as they are, with the reason
================= =====================================================================================================

- what words do, and what holds: `control`; what is a run: `runs`
- `spelling`: how the program writes numbers; `motion`: what a control does in a run; `writing`: blocks in its place
- `checking`: program against program; `program`: all of it, as one call
"""

from cornersmooth.filter.program import Filtered, filter_program, verify_programs

__all__ = ["Filtered", "filter_program", "verify_programs"]
