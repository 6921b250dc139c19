"""A block and its halves, reduced and joined."""

import pytest

import rom
from cases.solid import KINDS, STEEL, block, reduced

COUPLED = ((("left", "tip"), ("right", "root")),)
ROOT = ("left", "root")


def half(side, kind, cells=(4, 2, 2), n_modes=None):
    """Half of a block of 1 m, its inner end of that kind, its outer one rigid."""
    origin = (0.0 if side == "left" else 0.5, 0.0, 0.0)
    model = block(size=(0.5, 0.1, 0.08), cells=cells, origin=origin)
    inner, outer = ("tip", "root") if side == "left" else ("root", "tip")
    if n_modes is None:
        n_modes = model.n_dofs - sum(i.dofs.size for i in model.interfaces.values())
    return reduced(n_modes, model, interfaces={inner: kind, outer: "rbe2"})


def halves(kind, cells=((4, 2, 2), (4, 2, 2)), n_modes=None):
    ends = zip(("left", "right"), cells, strict=True)
    return {side: half(side, kind, c, n_modes) for side, c in ends}


def joined(*arguments, **options):
    return rom.Assembly(halves(*arguments, **options), COUPLED)


def whole(cells=(8, 2, 2), fixed=("root",), n=12):
    model = block(size=(1.0, 0.1, 0.08), cells=cells)
    return rom.modes(model, n, fixed=fixed, interfaces=KINDS).frequencies


# Two blocks of 0.5 m x 0.2 m x 0.1 m, 10 x 4 x 2 quadratic hexahedra each, joined end to end and
# clamped; 30 fixed-interface modes per part: largest error of ten frequencies, and of the first.
FULL = [83.7183, 163.1955, 502.0571, 608.7706, 880.6759, 1298.7913, 1322.9043, 1832.3322,
        2101.1013, 2405.4061]  # fmt: skip


def study(kind, cells=(10, 4, 2)):
    """Bodies and couplings of the two blocks; the right one with these cells."""
    pytest.importorskip("dolfinx", reason="needs quadratic hexahedra")
    from cases.boxes import box
    from rom.fe.elasticity import assemble

    bodies = {}
    for name, start, kinds in (
        ("left", 0.0, {"x0": "rbe2", "x1": kind}),
        ("right", 0.5, {"x0": kind}),
    ):
        mesh, tags = box((0.5, 0.2, 0.1), cells if name == "right" else (10, 4, 2), "hexahedron")
        mesh.geometry.x[:, 0] += start
        model = assemble(mesh, None, tags, material=STEEL, degree=2)
        bodies[name] = reduced(30, model, interfaces=kinds)
    return bodies, ((("left", "x1"), ("right", "x0")),)
