"""Meshes, from a file to dolfinx.

`sources` reads files into a `solid`; `topology`, `quality`, `repair`, `validate` and `summary`
look at it; `cell_types` numbers nodes; `distribute` hands it to the ranks; `read` does all.
"""

from rom.lazy import front

__all__ = ["LARGEST_FILE", "READERS", "checked", "read_mesh", "to_dolfinx"]
__getattr__ = front(__name__, "read", __all__)
