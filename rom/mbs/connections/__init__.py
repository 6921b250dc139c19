"""Joints, one class of them in one file: the method of `rom.Mechanism` and its constraints.

`lower_pairs` share a surface, `points` stay on lines, in planes, at a distance, in the middle of a
cross, or roll; `drives` prescribe a coordinate or couple two. `ends` is what a joint must know of
both bodies. Another joint is one function more.
"""
