"""Measured responses of test programs, as `rom.updating.Responses`.

`reading` picks by the ending of a file, and knows HDF5: `universal_test` reads universal files with
nodes and mode shapes, `tables` texts of spectrum analysers. `unit_labels` has their units, `grid`
sets functions of single pairs of sensor and force side by side.
"""
