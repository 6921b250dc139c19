"""Functional Mock-up Units: the archive, its description, its C code; and FMUs of bodies."""
