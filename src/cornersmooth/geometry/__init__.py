"""Curves and arcs for all who make programs: B-splines, NURBS, arcs, and rows of different length in flat arrays.

`nc_reader` and `verify` have their own: they judge what is made here, and must not share a fault with it.
"""
