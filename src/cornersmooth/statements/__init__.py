"""Statements beside the motion: what the CL file asks for, what a text says, and whether that is the same.

Verification's own, as `nc_reader` is: shares no code with what writes. `asked` and `cycles` interpret the CL file,
`tokens` the words of a program; both give tokens, and `comparison` compares them.
"""
