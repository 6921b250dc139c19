"""A U of thick aluminium sheet, free: one solid with corners of their own stiffness."""

from measured.record import Numbers, Structure

import rom
from cases.paths import ROOT

N_MODES = 13
CELLS = {"n_leg": 12, "n_web": 4, "n_wide": 6, "n_thick": 1}  # hexahedra on the coarse mesh


def solid(mesh, *, E=70e9, rho=2745.0, t=10e-3, leg=0.3, corners=1.0):
    """The model; the corners have a share of the modulus."""
    sheet, corner = (
        rom.Material(E=E, nu=0.33, rho=rho),
        rom.Material(E=corners * E, nu=0.33, rho=rho),
    )
    cells = {name: mesh * n for name, n in CELLS.items()}
    return rom.fe.model(
        ROOT / "meshes" / "jim_beam.geo", parameters={"t": t, "L": leg} | cells,
        material={"legs": sheet, "web": sheet, "corners": corner},
    )  # fmt: skip


def frequencies(mesh, **parameters) -> Numbers:
    """The first thirteen elastic ones [Hz]."""
    body = rom.reduce(solid(mesh, **parameters), method=rom.CraigBampton(40),
                      interfaces={"tip": "rbe3"}, certify=False)  # fmt: skip
    f = body.frequencies(6 + N_MODES)[6:]
    return {f"mode {k} [Hz]": float(x) for k, x in enumerate(f, 1)}


JIM_BEAM = Structure(
    "jim_beam",
    frequencies,
    {"E": (70e9, 1.4e9), "rho": (2745.0, 27.0), "t": (10e-3, 0.2e-3), "leg": (0.3, 1e-3),
     "corners": (1.0, 0.6)},
    (1, 2),
    "In one piece, as drawn, and free. How legs and web are joined is not said: the modulus of the "
    "corners, 10 mm square, has a wide spread. Known beforehand: a plane frame with stiff corners "
    "is 4 to 14 % above what was measured.",
)  # fmt: skip
