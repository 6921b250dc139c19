"""Observers of a body in operation, by few sensors.

`operation` says what is measured, `tracking` follows motion, forces and stress,
`parameter_tracking` also what changes, both by the `filter_steps`; `fmu` writes one as a
Functional Mock-up Unit.
"""
