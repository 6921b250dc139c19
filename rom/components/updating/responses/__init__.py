"""Measured responses of test programs, as `rom.updating.Responses`.

`reading` picks by the ending of a file: `universal_test` reads universal files with nodes and mode
shapes, `tables` texts of spectrum analysers, `arrays` HDF5. `unit_labels` has their units, `grid`
sets functions of single pairs of sensor and force side by side.
"""
