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

- what a text is: `source` (bytes), `dialects` (grammar), `word_tables` (words and what they mean)
- bytes to tables: `lexer`, `words`, `block_tables`, `line_patterns`
- tables to elements: `reader` holds the modal state, `execution` executes: `arcs`, `splines`, `rotary`;
  `needed_states` says which words want another state; `retracts` leads back from retracts
- what comes out: `elements`; `ahead` reads on as far as need be, `curves` evaluates, `reading` puts a
  whole text together
"""

from cornersmooth.nc_reader.elements import Event, NcProgram, Problem
from cornersmooth.nc_reader.reading import CONTROLS, read_nc

__all__ = ["CONTROLS", "Event", "NcProgram", "Problem", "read_nc"]
