"""NC text read back: what a control makes of it, with nothing known of who wrote it.

Verification, plans of written texts, pages and the machined surface all start from it. Shares no code with
`smoothing` and `nc`, which make such texts::

    bytes -> chunks -> tables -> elements

================= =====================================================================================================
word              meaning
================= =====================================================================================================
block             an NC block: a line of the text
chunk, table      bytes read at a time; a run of motion blocks as columns of words
element           what a motion block does: rapid, line, arc or curve; rotary words may make several lines of one block
event             a word that stands beside the motion
================= =====================================================================================================

Where is what:

- bytes to tables: `control` (lines, words and what they mean), `dialects` (grammar), `acts` (what a block does)
- tables to elements: `reader` goes through the text (`reading`: a whole one), `execution` executes, with `splines` and
  `rotary`; `needed_states` says which words want another state; `retracts` leads back from them
- what comes out: `elements`; `tool` says where the tool is
"""

from cornersmooth.control.table import CONTROLS
from cornersmooth.nc_reader.elements import Event, NcProgram, Problem
from cornersmooth.nc_reader.reading import read_nc

__all__ = ["CONTROLS", "Event", "NcProgram", "Problem", "read_nc"]
