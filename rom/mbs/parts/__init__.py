"""What mechanisms are made of.

`bodies` with markers, `joints` as rows of constraints, `signals` of time and their jumps;
`foreign` asks the functions that users hand over.
"""

from rom.lazy import front

front(__name__)
