"""Curves, arcs and tools for all who make programs: B-splines, NURBS, arcs, shapes, rows of different length in arrays.

`nc_reader` and `verify` have their own: they judge what is made here, and must not share a fault with it.
"""
