"""Bodies for other multibody programs, one module each.

`exudyn`, `mbdyn`, `radioss`, `simscape` and `openfast` write, `openfast_reading` reads;
`interface_form` has a body in the coordinates of its interfaces, which some of them want.
"""
