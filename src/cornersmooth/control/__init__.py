"""What a control remembers while it runs a program: a table of words, the state they change, and the stream.

Unknown is a value of every group, and what each word without a row makes of all. `source` (bytes), `words` (one line)
and `line_patterns` (all lines of a kind at once) bring bytes to rows. `table` has what a word does, of `[words]` in
``word_lists``. `state` executes one block, or a run of motion blocks by arrays. `program` has all blocks in order,
which of them may be jumped to, what no lexer knows, and what ``cornersmooth explain --stream`` prints.
"""
