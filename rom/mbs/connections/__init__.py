"""Joints, one class of them in one file: the method of `rom.Mechanism` and its constraints.

`lower_pairs` share a surface, `universal` joints a point and two axes, `points` stay on lines, in
planes or at a distance; `rolling` without slip, `gears` between joints, `drives` that prescribe a
coordinate. `ends` is what a joint must know of both bodies. Another joint is one function more.
"""
