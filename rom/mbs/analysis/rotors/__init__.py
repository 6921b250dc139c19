"""Rotors: what turns steadily, and how small motions of what turns are counted."""
