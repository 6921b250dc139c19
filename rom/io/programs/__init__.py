"""Bodies for other multibody programs.

`exudyn`, `mbdyn` and `openfast` write, the last reads as well; `superelements` are for Simscape and
OpenRadioss; `interface_form` has a body in the coordinates of its interfaces, which some want.
"""
