"""Reports in one HTML file that needs nothing else.

`html` writes them, `pages` fills them for bodies, for files and for motions, `run` moves what a
mechanism file describes and keeps it in a folder. `viewer` makes the figures that turn, from what
`scene` takes of a body or a motion and keeps with a run, and `coarse` makes small. `pieces` sets
those of a solid, welded in a mechanism, beside the whole.
"""

from rom.lazy import front

front(__name__)
