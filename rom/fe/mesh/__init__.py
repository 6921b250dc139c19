"""Meshes, from a file to dolfinx.

`sources` reads files into a `solid`, in a `child` process; `picks` says which faces are meant,
`cad` what is known of them; `topology`, `curving`, `quality`, `repair`, `validate` and `summary`
look at it; `cell_types` numbers nodes; `cut` makes pieces, `input_deck` hands it to other programs,
`read` does all, and hands it to the ranks.
"""

from rom.lazy import front

front(__name__)
