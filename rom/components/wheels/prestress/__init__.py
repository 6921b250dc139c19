"""Solids under heat and in steady rotation.

`heat` and `thermal` stress a body, `steady_rotation` and `spin_up` turn it at large displacement,
`speed_table` has the states over the speed.
"""
