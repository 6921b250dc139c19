"""Matrices of other finite element programs.

`read_model` makes a model of them; `matrix_files` reads Matrix Market and CalculiX, or picks
`dmig`, `op4`, `user_element`; `node_files` has the points.
"""
