"""Solids under heat and in steady rotation.

`thermal` stresses a body by heat, `steady_rotation` and `spin_up` turn it at large displacement.
"""
