"""The GARTEUR test bed corrected by its measured frequencies, and what it does when modified.

`rom.update` compares frequency responses; published are frequencies alone. So the family and its
derivatives are those of `rom.update`, and what is made small are logarithms of frequencies over
their spread among laboratories, with what was known before as a prior.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from measured import garteur
from measured.garteur import BUNGEES, COUPLINGS, FACES, PARTS, POWER, SHAPES, TIPS
from scipy.linalg import eigh

import rom
from rom.components.updating.family_model import Parts, family_model
from rom.updating import AddedMass, Channels, GroundSpring

MESH = 50
CONTACT = 10**11.5
GIVEN = {"strip": True, "E": 71e9, "rho": garteur.DENSITY, "t": 0.010, "b": 0.035}
# what is sought: names of the family, and the standard deviation of a logarithm before the test
SOUGHT = {
    "E": ((), 0.017),  # of all but contacts and tape
    "wing": (("wing.E",), 0.02),  # over that of all
    "root": (("wing.contact",), 0.6),
    "drums": (("left.contact", "right.contact"), 0.6),
    "tail": (("fin.contact",), 0.6),
    "tape": (("wing.tape",), 0.35),
}
NAMES = (
    "fuselage.E", "wing.contact", "wing.E", "wing.tape", "left.contact", "right.contact",
    "fin.contact", "tailplane.E", "below root", "below rear", "tip left", "tip right",
    "brass middle", "brass end_left", "brass end_right",
)  # fmt: skip
NONE = 1e-9  # factor of a mass that is not there
TIP, BRASS, BRASSES = 0.150, 0.92, ("middle", "end_left", "end_right")  # kg; on the tailplane
# what keeps its stiffness where aluminium gets stiffer: over it, these are softer
SOFTER = (
    "wing.contact", "wing.tape", "left.contact", "right.contact", "fin.contact", "below root",
    "below rear",
)  # fmt: skip


@cache
def bed():
    """The family with its tip masses, brass and bungees, in few coordinates."""
    families = {}
    for name in PARTS:
        free = {"contact": rom.YoungsModulus("contact", 0.1, 10.0)}
        if name == "wing":
            free |= {"E": rom.YoungsModulus("wing", 1.0, 1.0), "tape": garteur.TAPES}
        elif name in ("fuselage", "tailplane"):
            free = {"E": rom.YoungsModulus(None, 1.0, 1.0)}  # a family needs one
        families[name] = garteur.reduced(
            name, free, MESH, **GIVEN | {"strip": name == "wing", "contact": CONTACT}
        )
    whole = rom.parametric.FamilyAssembly(families, COUPLINGS, FACES)
    stiff = (2 * np.pi * 2.3) ** 2 * (sum(one.body.mass for one in families.values()) + 0.3)
    hung = {f"below {face}": GroundSpring((body, face), (0, 0, share * stiff), NONE, 10.0)
            for (body, face), share in BUNGEES.items()}  # fmt: skip
    hung |= {f"tip {body}": AddedMass((body, face), TIP, NONE, 10.0) for body, face in TIPS}
    hung |= {f"brass {face}": AddedMass(("tailplane", face), BRASS, NONE, 1.0) for face in BRASSES}
    rows = Channels(*map(np.array, zip(*garteur.PLACES, strict=True))).rows(
        Parts.of(whole).bodies, "place", 0.03
    )
    model = family_model(whole, (rows, rows[:1]), hung, {}, ())
    columns = []
    for factor in (0.1, 1.0, 10.0):
        here = model.at(
            logarithms(dict.fromkeys(("root", "drums", "tail", "tape"), np.log(factor)))
        )
        columns.append(eigh(here.K, here.M, subset_by_index=(0, 59))[1])
    T = np.linalg.qr(np.hstack(columns))[0]
    return model.reduced(T, np.ones(len(NAMES), bool), np.zeros(len(NAMES)), model.sensors @ T)


def logarithms(sought, *, heavy=TIP, brass=0.0, bar=0.1):
    """(n_p,) logarithms of factors; one tip mass and the brass [kg], a share of that at the ends."""
    x = dict.fromkeys(NAMES, 0.0)
    for name, value in sought.items():
        x |= dict.fromkeys(SOUGHT[name][0], value)
    for name in SOFTER:
        x[name] -= sought.get("E", 0.0)
    x["tip left"] = np.log(heavy / TIP)
    for face in BRASSES:
        share = 1 - bar if face == "middle" else bar / 2
        x[f"brass {face}"] = np.log(max(share * brass / BRASS, NONE))
    return np.array([x[name] for name in NAMES])


def modes(sought, **modified):
    """Frequencies (14,) [Hz], loss by that of the tape, shapes (channels, 14), by name.

    And (14, 6) the derivatives of logarithms of frequencies by what is sought.
    """
    model, known = bed().at(logarithms(sought, **modified)), garteur.reference(True)
    T, E = model.dK[NAMES.index("wing.tape")], sought.get("E", 0.0)
    f, loss, shapes = np.full(len(SHAPES), 40.0), np.zeros(len(SHAPES)), known.copy()
    J = np.zeros((len(SHAPES), len(SOUGHT)))
    for _ in range(3):  # the tape as stiff as it is at the frequency of each
        for k in range(len(SHAPES)):
            g = (f[k] / 10.0) ** POWER
            lam, V = eigh(model.K + (g - 1) * T, model.M, subset_by_index=(0, 26))
            U = model.sensors @ V
            like = (known[:, k] @ U) ** 2 / (U**2).sum(axis=0)
            one = int(like[6:].argmax()) + 6
            v, f[k] = V[:, one], np.exp(E / 2) * np.sqrt(lam[one]) / 2 / np.pi
            shapes[:, k] = U[:, one] / np.linalg.norm(U[:, one])
            part = np.einsum("i,nij,j->n", v, model.dK, v) / lam[one]
            part[NAMES.index("wing.tape")] *= g
            loss[k] = part[NAMES.index("wing.tape")]
            J[k] = [sum(part[NAMES.index(name)] for name in names) for names, _ in SOUGHT.values()]
            J[k, 0] = 1 - sum(part[n] for n, name in enumerate(NAMES) if name in SOFTER)
    return f, loss, shapes, J / (2 - POWER * loss[:, None])


@dataclass(frozen=True)
class Found:
    """What frequencies say of the unknowns: logarithms of factors, their covariance, the misfit.

    Attributes:
        sought: {name: logarithm}.
        covariance: (6, 6) of these.
        misfit: chi-square of the frequencies over their number [1], before and after.
        before, after: {shape: frequency [Hz]}.
    """

    sought: dict[str, float]
    covariance: np.ndarray
    misfit: tuple[float, float]
    before: dict[str, float]
    after: dict[str, float]


def updated(measured, spread, *, steps=6):
    """By {shape: frequency [Hz]} and the standard deviation of their logarithms: one, or each."""
    rows = [SHAPES.index(shape) for shape in measured]
    wide = np.broadcast_to(spread, len(rows))
    prior, x, told = np.array([sigma for _, sigma in SOUGHT.values()]), np.zeros(len(SOUGHT)), []
    for _ in range(steps):
        f, _, _, J = modes(named(x))
        told.append(f[rows])
        r, J = np.log([*measured.values()] / f[rows]) / wide, J[rows] / wide[:, None]
        N = J.T @ J + np.diag(prior**-2.0)
        last, misfit = x, r @ r / len(rows)
        first = first if len(told) > 1 else misfit
        x = x + np.clip(np.linalg.solve(N, J.T @ r - x / prior**2), -1.0, 1.0)
    before, after = (dict(zip(measured, f, strict=True)) for f in (told[0], told[-1]))
    return Found(named(last), np.linalg.inv(N), (first, misfit), before, after)


def named(x):
    """{name: logarithm} of what is sought."""
    return dict(zip(SOUGHT, x, strict=True))
