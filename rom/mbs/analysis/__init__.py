"""Answers without a time integration.

Rest, tangents and modes: `equilibrium`, `linearize`, `campbell`, `response`, `steady_motion`,
`sensitivity`, `inverse_dynamics`; `local_equations`, `tangent` and `few_modes` are what they are
made of. `rotors` has what turns: steady motions and the axes of small ones. `law_check` looks for
mistakes in laws of the user.
"""
