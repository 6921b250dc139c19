"""Panels of two materials, with finite elements, and of layers whose thickness varies."""

from dataclasses import replace

import rom
from cases.paths import ROOT

SANDWICH = ROOT / "meshes" / "sandwich.geo"
FOAM, ALLOY = rom.Material(E=70e6, nu=0.3, rho=60.0), rom.Material(E=70e9, nu=0.33, rho=2700.0)
STIFF_FOAM = replace(FOAM, E=700e6)
KINDS = {"root": "rbe2", "tip": "rbe2"}
LAYERS = {"t_core": rom.Thickness("core", 0.7, 1.8), "t_faces": rom.Thickness("faces", 0.7, 1.4)}
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


def layered_panel(t_core=1.0, t_faces=1.0, *, E=1.0, core=STIFF_FOAM):
    """The panel made with these thicknesses of its layers."""
    return rom.fe.model(
        SANDWICH,
        material={"core": replace(core, E=E * core.E), "faces": ALLOY},
        parameters={"nx": 5, "ny": 2, "core": 0.02 * t_core, "face": 0.002 * t_faces},
    )


def family_of_layers(model):
    return rom.reduce_parametric(
        model, parameters=LAYERS, method=rom.CraigBampton(16), interfaces=KINDS, certify=False
    )
