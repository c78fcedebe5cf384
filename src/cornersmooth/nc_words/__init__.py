"""Words of an NC program: whether each is on the list of its control and in its place, and which states hold.

Nothing in it measures motion, and nothing in it knows the CL file: what that asks for, `statements` compares.

=================== ===================================================================================================
what is decided     where
=================== ===================================================================================================
the closed list     `rules`, of the control's table in `nc_reader/word_lists`
one block           `blocks`: which rule each word falls under, and what may not be together
states              `states`: what holds where the tool moves, is changed, or the program ends
positions           `machine_positions`: those of the machine's file
all blocks in order `check`: the walk, how a program begins and ends, and what is taken on trust
=================== ===================================================================================================
"""
