"""Compiled mechanics, and the arrays it works on.

`system` has the arrays, in `tables`, `work` what is computed of them; `stages` are compiled alone,
and so are kernels of elements, by `element_calls`; `algebra` has small matrices, `inertia`,
`second_order`, `markers`, `constraints` and `coordinates` the mechanics; `compiled` makes kernels
of functions.
"""
