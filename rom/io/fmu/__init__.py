"""Functional Mock-up Units: the archive, its description, its C code; and FMUs of bodies.

`description` says what variables there are, `archive` compiles the C code and packs it, `body`
writes the linear equations of a body.
"""
