"""What a control remembers while it runs a program: a table of words, the state they change, and the stream.

Unknown is a value of every group, and what each word without a row makes of all.

================= =====================================================================================================
what is decided   where
================= =====================================================================================================
bytes to rows     `source` (bytes), `lexer` (one line), `line_patterns` (all lines of a kind at once), `words`
what a word does  `table`, of `[words]` in ``word_lists``; `word_tables` has all keys
one block         `state`: groups, the place, and the feed, before and after it
what no lexer     `unread`: variables, jumps, paths of a kind that is not known
knows
runs of blocks    `rows`: the same for motion blocks, by arrays
a program         `program`: its blocks in order, and which of them may be jumped to
as text           `listing`: what ``cornersmooth explain --stream`` prints
================= =====================================================================================================
"""
