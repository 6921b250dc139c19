"""Flexible bodies: inertia integrals, reference conditions, damping."""
