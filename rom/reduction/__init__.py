"""Reduction: `bases` of shapes, on `interfaces` of a kind; `full_model` has what is reduced.

A method of `bases` is a record that `rom.reduce` takes; a kind of interface is its name, "rbe2",
or a record of `interfaces`.
"""

from rom.lazy import front

front(__name__)
