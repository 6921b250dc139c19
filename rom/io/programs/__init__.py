"""Bodies for other multibody programs, one module each.

`exudyn`, `mbdyn`, `radioss`, `simscape` and `openfast` write, the last reads as well;
`interface_form` has a body in the coordinates of its interfaces, which some of them want.
"""
