"""Multibody dynamics in the floating frame of reference."""
