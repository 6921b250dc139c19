"""Panels of layers."""

from dataclasses import replace

import rom
from cases.paths import ROOT

KINDS = {"root": "rbe2", "tip": "rbe2"}


FOAM, ALLOY = rom.Material(E=700e6, nu=0.3, rho=60.0), rom.Material(E=70e9, nu=0.33, rho=2700.0)


LAYERS = {"t_core": rom.Thickness("core", 0.7, 1.8), "t_faces": rom.Thickness("faces", 0.7, 1.4)}


def panel(t_core=1.0, t_faces=1.0, *, E=1.0, core=FOAM):
    return rom.fe.model(
        ROOT / "meshes" / "sandwich.geo",
        material={"core": replace(core, E=E * core.E), "faces": ALLOY},
        parameters={"nx": 5, "ny": 2, "core": 0.02 * t_core, "face": 0.002 * t_faces},
    )


def families(model):
    return rom.reduce_parametric(
        model, parameters=LAYERS, method=rom.CraigBampton(16), interfaces=KINDS, certify=False
    )
