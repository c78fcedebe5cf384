"""Words of an NC program: whether each is on the list of its control and in its place, and which states hold.

Nothing in it measures motion, and nothing in it knows the CL file: what that wants, `statements` compares. `check`
walks through all blocks in order. `blocks` has the rules of one block, `states` those of groups where the tool moves or
is changed, `parts` the digests of what is not of the motion.
"""
