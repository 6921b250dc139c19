"""Small body, family and state files."""

import numpy as np

import rom
from cases.solid import block
from rom.mbs.results.state import Memory, State

KINDS = {"root": "rbe2", "tip": "rbe2"}


def body(folder):
    made = rom.reduce(block(cells=(2, 1, 1)), method=rom.CraigBampton(1), interfaces=KINDS)
    return rom.save(made, folder / "x.rom.npz")


def family(folder):
    made = rom.reduce_parametric(
        block(cells=(2, 1, 1)), parameters={"rho": rom.Density(None, 0.5, 2.0)}, tol=0.5,
        method=rom.CraigBampton(1), interfaces=KINDS, damping=rom.Rayleigh(0.0, 1e-6),
    )  # fmt: skip
    return rom.save(made, folder / "x.rom.npz")


def state(folder):
    rng = np.random.default_rng(1)
    q, v, a, lam = (rng.normal(size=n) for n in (7, 6, 6, 5))
    memory = Memory("generalized-alpha", 1e-2, 0.0, 3, {"a": a})
    return rom.save_state(State(t=0.3, rank=5, q=q, v=v, a=a, lam=lam, memory=memory),
                          folder / "x.state.npz")  # fmt: skip


ARCHIVES = {  # what makes a small file of each kind, and what reads it
    "body": (body, rom.load),
    "family": (family, rom.load),
    "state": (state, rom.load_state),
}
