"""Archives of Ansys of a box, as CDWRITE writes them."""

from itertools import pairwise

import numpy as np

from cases.files.cells import solid
from rom.fe.mesh.cell_types import DECK_EDGES, READ_TYPES

LAWS = """MPTEMP,R5.0, 1, 1,  0.00000000    ,
MPDATA,R5.0, 1,EX  ,       1, 1,  210000.000    ,
MPDATA,R5.0, 1,PRXY,       1, 1, 0.300000000    ,
MPDATA,R5.0, 1,DENS,       1, 1, 7.850000000E-09,
MP,EX,2,100000.,  ! by hand
MP,NUXY,2,0.34
MP,DENS,2,8.5e-9
MP,KXX,2,60.,1.,2.
TB,BISO,2
TBDATA,1,235.
"""
BRICK = (0, 1, 2, 2, 3, 3, 3, 3)  # corners of a tetrahedron drawn as a brick
TYPES = {"tet4": 285, "tet10": 187, "hex8": 185, "hex20": 186}


def archive(kind, *, bricks=False, size=(2.0, 1.0, 1.0)):
    """Text of a box in mm, with the last cell of another material, and its mesh."""
    mesh = solid("hex27" if kind == "hex20" else kind, (2, 2, 2), size)
    type_ = READ_TYPES[kind]
    edges = type_.among(DECK_EDGES.get(kind, ()))
    used, cells = np.unique(mesh.cells[:, [*range(type_.n_corners), *edges]], return_inverse=True)
    points, cells = mesh.points[used], cells.reshape(-1, type_.n_nodes) + 1
    if bricks:
        cells = (
            cells[:, BRICK]
            if kind == "tet4"
            else cells[:, [*BRICK, 4, 5, 2, 6, *4 * [3], 7, 8, 9, 9]]
        )
    rows = [f"/PREP7\nET,       5,{TYPES[kind] if not bricks else 186}\nET,6,154",
            f"NBLOCK,6,SOLID,{len(points):9d},{len(points):9d}\n(3i9,6e21.13e3)"]  # fmt: skip
    for k, x in enumerate(points, 1):
        row = "".join(f"{v:21.13E}" for v in x)
        rows.append(f"{k:9d}{0:9d}{0:9d}{row}")
    rows.append(f"N,R5.3,LOC,       -1,\nEBLOCK,19,SOLID,{len(cells):10d}\n(19i10)")
    for k, cell in enumerate(cells, 1):
        head = (1 + (k == len(cells)), 5, 1, 1, 0, 0, 0, 0, len(cell), 0, k)
        words = [f"{n:10d}" for n in (*head, *cell)]
        rows += ["".join(words[:19])] + ["".join(words[19:])] * (len(words) > 19)
    root = np.flatnonzero(points[:, 0] == 0.0) + 1
    ranges = [root[0], *(-n if n == m + 1 else n for m, n in pairwise(root))]
    rows.append(f"        -1\nCMBLOCK,ROOT    ,NODE,{len(root):8d}  ! users node component\n(8i10)")
    rows += ["".join(f"{n:10d}" for n in ranges[k : k + 8]) for k in range(0, len(ranges), 8)]
    return "\n".join([*rows, LAWS]), mesh
