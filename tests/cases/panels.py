"""Panels of two materials, with finite elements."""

from dataclasses import replace

import rom
from cases.paths import ROOT

SANDWICH = ROOT / "meshes" / "sandwich.geo"


FOAM, ALLOY = rom.Material(E=70e6, nu=0.3, rho=60.0), rom.Material(E=70e9, nu=0.33, rho=2700.0)


KINDS = {"root": "rbe2", "tip": "rbe2"}


PARAMETERS = {
    "E_core": rom.YoungsModulus("core", 0.2, 5.0),
    "E_all": rom.YoungsModulus(None, 0.8, 1.25),
    "rho_core": rom.Density("core", 0.5, 2.0),
}


def panel(E_core=1.0, E_all=1.0, rho_core=1.0, core=FOAM, faces=ALLOY):
    """The panel made with these materials."""
    factors = {"core": (E_core * E_all, rho_core), "faces": (E_all, 1.0)}
    return rom.fe.model(
        SANDWICH,
        material={
            name: scaled(solid, *factors[name])
            for name, solid in (("core", core), ("faces", faces))
        },
        parameters={"nx": 6, "ny": 2},
    )


def scaled(solid, E, rho):
    if isinstance(solid, rom.Material):
        return replace(solid, E=E * solid.E, rho=rho * solid.rho)
    moduli = {name: tuple(E * x for x in getattr(solid, name)) for name in ("E", "G")}
    return replace(solid, rho=rho * solid.rho, **moduli)
