"""One pair of cubic B-splines for a whole run of corners: the mathematics of `method="global"` (docs/global.md).

A run is a row of distinct poses whose inner ones are rounded together. All functions work on flat arrays: the runs of a
program stand one behind the other, and `first` says where each begins.
"""
