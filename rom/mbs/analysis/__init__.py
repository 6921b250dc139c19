"""Answers without a time integration.

`local_equations`, `tangent` and `few_modes` are what the others are made of; `rotors` has what
turns: steady motions and the axes of small ones. `law_check` looks for mistakes in laws of users.
"""
