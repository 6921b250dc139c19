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
STIFF = ("fuselage.E", "wing.E", "tailplane.E")


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
        here = model.at(logarithms(dict.fromkeys(("root", "drums", "tail", "tape"), np.log(factor))))
        columns.append(eigh(here.K, here.M, subset_by_index=(0, 59))[1])
    T = np.linalg.qr(np.hstack(columns))[0]
    return model.reduced(T, np.ones(len(NAMES), bool), np.zeros(len(NAMES)), model.sensors @ T)


def logarithms(sought, *, heavy=TIP, brass=0.0, bar=0.1):
    """(n_p,) logarithms of factors; one tip mass and the brass [kg], a share of that at the ends."""
    x = dict.fromkeys(NAMES, 0.0)
    for name, value in sought.items():
        x |= dict.fromkeys(SOUGHT[name][0], value)
    for name in NAMES:  # what is no aluminium is softer where that is stiffer
        if not name.startswith(("tip", "brass")) and name not in STIFF:
            x[name] -= sought.get("E", 0.0)
    x["tip left"] = np.log(heavy / TIP)
    for face in BRASSES:
        share = 1 - bar if face == "middle" else bar / 2
        x[f"brass {face}"] = np.log(max(share * brass / BRASS, NONE))
    return np.array([x[name] for name in NAMES])


def modes(sought, **modified):
    """Frequencies (14,) [Hz], loss by that of the tape [1], shapes (channels, 14), by name."""
    model, known = bed().at(logarithms(sought, **modified)), garteur.reference(True)
    T, scale = model.dK[NAMES.index("wing.tape")], np.exp(sought.get("E", 0.0) / 2)
    f, loss, shapes = np.full(len(SHAPES), 40.0), np.zeros(len(SHAPES)), known.copy()
    for _ in range(3):  # the tape as stiff as it is at the frequency of each
        for k in range(len(SHAPES)):
            g = (f[k] / 10.0) ** POWER
            lam, V = eigh(model.K + (g - 1) * T, model.M, subset_by_index=(0, 26))
            U = model.sensors @ V
            like = (known[:, k] @ U) ** 2 / (U**2).sum(axis=0)
            one = int(like[6:].argmax()) + 6
            f[k], shapes[:, k] = scale * np.sqrt(lam[one]) / 2 / np.pi, U[:, one]
            loss[k] = g * V[:, one] @ T @ V[:, one] / lam[one]
    return f, loss, shapes


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


def updated(measured, spread, *, steps=5):
    """By {shape: frequency [Hz]} and the standard deviation of their logarithms: one, or by shape."""
    rows = [SHAPES.index(shape) for shape in measured]
    target, wide = np.log([*measured.values()]), np.broadcast_to(spread, len(rows))
    prior = np.array([sigma for _, sigma in SOUGHT.values()])
    x = np.zeros(prior.size)
    for step in range(steps + 1):
        y, J = sensitivity(x, rows)
        r = (target - y) / wide
        if step == 0:
            first = y, r @ r
        N = (J / wide[:, None]).T @ (J / wide[:, None]) + np.diag(prior**-2.0)
        if step < steps:
            x = x + np.clip(np.linalg.solve(N, (J / wide[:, None]).T @ r - x / prior**2), -1, 1)
    told = (dict(zip(measured, np.exp(one), strict=True)) for one in (first[0], y))
    misfit = first[1] / len(rows), r @ r / len(rows)
    return Found(dict(zip(SOUGHT, x, strict=True)), np.linalg.inv(N), misfit, *told)


def sensitivity(x, rows=slice(None), **modified):
    """Logarithms of frequencies, and their derivatives by the unknowns."""
    value = lambda x: np.log(modes(dict(zip(SOUGHT, x, strict=True)), **modified)[0])[rows]
    steps = 0.05 * np.eye(len(SOUGHT))
    J = [(value(x + step) - value(x - step)) / 0.1 for step in steps]
    return value(x), np.array(J).T
