"""One pair of cubic B-splines for a whole run of corners: the mathematics of `method="global"` (docs/global.md).

A run is a row of distinct poses whose inner ones are rounded together. The runs of a program follow one another in flat
arrays, and `first` is where each begins.
"""
