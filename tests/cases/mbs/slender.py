"""Slender solids of finite elements that bend far, and their reduced bodies."""

import rom
from cases.boxes import box, distort

E_STEEL = 210e9
STEEL = rom.Material(E=E_STEEL, nu=0.3, rho=7850.0)


def assembled(size=(1.0, 0.1, 0.08), cells=(3, 1, 1), kind="hexahedron", degree=2, **options):
    from rom.fe.elasticity import assemble

    mesh, faces = box(size, cells, kind)
    if options.pop("distorted", False):
        distort(mesh, 0.05)
    material = options.pop("material", STEEL)
    facets = {"root": faces["x0"], "tip": faces["x1"]}
    return assemble(mesh, facet_tags=facets, material=material, degree=degree)


def slender(slenderness, cells, nu=0.0):
    h = 1.0 / slenderness
    material = rom.Material(E=E_STEEL, nu=nu, rho=7850.0)
    return assembled((1.0, h, h), (cells, 1, 1), material=material), E_STEEL * h**4 / 12


def reduced(model, loads, *, n_modes=4, kinds="rbe3", certify=False, active=4, **options):
    return rom.reduce(
        model,
        method=rom.CraigBampton(n_modes=n_modes),
        interfaces={"root": kinds, "tip": kinds},
        reference="root",
        nonlinear=rom.Geometric(loads={"tip": loads}, n_modes=active, **options),
        certify=certify,
    )


def cantilever(body):
    """A mechanism of the body, its root held."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("beam", body)
    mech.fixed("wall", mech.ground.marker(part.point(part.marker("root"))), part.marker("root"))
    return mech, part
