"""The box with a removable component (BARC), free: solids in parts, reduced and joined."""

from dataclasses import replace

from measured.record import Structure

import rom
from cases.paths import ROOT

PARTS = {1: "box", 2: "left", 3: "right", 4: "beam"}
SQUARES = {"r_foot": 3.5e-3, "r_top": 5e-3}  # as wide as the heads of the bolts
# joints: kind of the interfaces, and half-widths of what touches
JOINTS = {
    "glued": (rom.Polynomial(4), {}),
    "rigid squares": ("rbe2", SQUARES),
    "averaged squares": ("rbe3", SQUARES),
}


def parts(mesh, kind, *, E=70e9, rho=2700.0, box=6.35e-3, sheet=3.175e-3, bolts=1.0, **patches):
    """{name: reduced body}; bolts hang on the box and on the beam, mesh in mm."""
    found, solid = {}, rom.Material(E=E, nu=0.33, rho=rho)
    sizes = {"lc": 1e-3 * mesh, "t_box": box, "t": sheet} | patches
    for number, name in PARTS.items():
        model = rom.fe.model(ROOT / "meshes" / "barc.geo", material=solid,
                             parameters={"part": number} | sizes)  # fmt: skip
        each = {"box": 12e-3 if patches else 48e-3, "beam": 15e-3}.get(name)
        carried = [rom.Attachment(i, bolts * each) for i in model.interfaces if each]
        found[name] = rom.reduce(
            replace(model, attachments=tuple(carried)), method=rom.CraigBampton(20), name=name,
            interfaces=dict.fromkeys(model.interfaces, kind), certify=False,
        )  # fmt: skip
    return found


def joined(bodies):
    """The assembly of the parts."""
    return rom.Assembly(bodies, tuple(
        ((side, name), ("box" if "foot" in name else "beam", name))
        for side in ("left", "right") for name in bodies[side].markers
    ))  # fmt: skip


def frequencies(mesh, **parameters):
    """The first twelve elastic ones, of each kind of joint [Hz]."""
    found = {}
    for joint, (kind, patches) in JOINTS.items():
        f = joined(parts(mesh, kind, **parameters, **patches)).frequencies(18)[6:]
        found |= {f"{joint}, mode {k} [Hz]": float(x) for k, x in enumerate(f, 1)}
    return found


BARC = Structure(
    "barc",
    frequencies,
    {"E": (70e9, 1.4e9), "rho": (2700.0, 27.0), "box": (6.35e-3, 5e-5), "sheet": (3.175e-3, 5e-5),
     "bolts": (1.0, 0.1)},
    (12, 6),
    "The support is not stated: free. Bolts weigh 15 g on the beam and 12 g on the box, as points. "
    "What holds the parts together is not known: whole faces, or squares around the bolts that are "
    "rigid or averaged; nobody knows which of these a test will be near to.",
)  # fmt: skip
