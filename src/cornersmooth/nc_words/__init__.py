"""Words of an NC program: whether each is on the list of its control and in its place, and which states hold.

Nothing in it measures motion, and nothing in it knows the CL file: what that asks for, `statements` compares.

=================== ===================================================================================================
what is decided     where
=================== ===================================================================================================
one block           `blocks`: which row of `control.table` each word falls under, and what may not be together
states              `states`: what must hold of the groups of `control.state` where the tool moves, or is changed
parts               `parts`: digests of what is not of the motion
positions           `machine_positions`: those of the machine's file
all blocks in order `check`: the walk, how a program begins and ends, and what is taken on trust
=================== ===================================================================================================
"""
