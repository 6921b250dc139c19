"""Decks of a box on whose nodes something hangs, in both dialects, and the models of them."""

import numpy as np

import rom
from cases.files.cells import solid

SIZE = (0.4, 0.05, 0.03)


def bulk(*cards, mesh=None, nodes=()):
    """Bulk data of a box whose ends are SPC1 1 and 2, with cards and nodes {label: place}."""
    mesh = mesh or solid("hex8", (4, 1, 1), SIZE)
    out = [f"GRID,{k},,{x!r},{y!r},{z!r}" for k, (x, y, z) in enumerate(mesh.points.tolist(), 1)]
    out += [f"GRID,{k},,{x!r},{y!r},{z!r}" for k, (x, y, z) in nodes]
    out += [f"CHEXA,{k},1,{long(row + 1)}" for k, row in enumerate(mesh.cells, 1)]
    out += [f"SPC1,{k},123,{long(ends(mesh, name))}" for k, name in ((1, "root"), (2, "tip"))]
    out += ["PSOLID,1,1", "MAT1,1,2.1+11,,.3,7850."]
    return "\n".join([*out, *cards, ""])


def long(numbers):
    """Fields behind the third, over as many lines as they need."""
    words = [str(n) for n in numbers]
    rows = [words[:6], *(words[k : k + 8] for k in range(6, len(words), 8))]
    return "\n,".join(",".join(row) for row in rows)


def ends(mesh, name):
    return np.unique(mesh.facets[name]) + 1


def keywords(text, mesh=None, nodes=(), kind="C3D8"):
    mesh = mesh or solid("hex8", (4, 1, 1), SIZE)
    rows = [f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(mesh.points.tolist(), 1)]
    rows += [f"{k}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in nodes]
    cells = [f"{k}, {', '.join(map(str, row + 1))}" for k, row in enumerate(mesh.cells, 1)]
    sets = [f"*NSET, NSET={n}\n{', '.join(map(str, ends(mesh, n)))}" for n in ("root", "tip")]
    law = "*SOLID SECTION, ELSET=e, MATERIAL=m\n"
    law += "*MATERIAL, NAME=m\n*ELASTIC\n210e9, .3\n*DENSITY\n7850."
    head = ["*NODE", *rows, f"*ELEMENT, TYPE={kind}, ELSET=e", *cells, *sets]
    return "\n".join([*head, "*SURFACE, NAME=face, TYPE=ELEMENT\n4, S4", law, text, ""])


def model_of(text, folder, **options):
    path = folder / ("a.inp" if text.startswith("*") or "*NODE" in text else "a.bdf")
    path.write_text(text)
    return rom.fe.model(path, **{"degree": 1} | options)
