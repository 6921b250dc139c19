"""The GARTEUR test bed corrected by its measured frequencies, and what it does when modified.

`rom.update` compares frequency responses; published are frequencies alone. So the family and its
derivatives are those of `rom.update`, and what is made small are logarithms of frequencies over
their spread among laboratories, with what was known before as a prior.
"""

import tomllib
from dataclasses import dataclass
from functools import cache

import numpy as np
from measured import garteur, record
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
    "angles": (("fin.angles",), 1.0),
    "tips": (("tip left", "tip right"), 0.15),
    "mass": (("on tailplane",), 1.0),  # of what hangs there, about 0.1 kg
}
NAMES = (
    "fuselage.E", "wing.contact", "wing.E", "wing.tape", "left.contact", "right.contact",
    "fin.contact", "fin.angles", "tailplane.E", "below root", "below rear", "on tailplane",
    "tip left", "tip right", "brass middle", "brass end_left", "brass end_right",
)  # fmt: skip
TESTED = 10  # modes that all laboratories have
MIDDLE = ("tailplane", "middle")
NONE = 1e-9  # factor of a mass that is not there
TIP, EXTRA, BRASS, BRASSES = (
    0.150,
    0.1,
    0.92,
    ("middle", "end_left", "end_right"),
)  # kg; on the tailplane
# what keeps its stiffness where aluminium gets stiffer: over it, these are softer
SOFTER = (
    "wing.contact", "wing.tape", "left.contact", "right.contact", "fin.contact", "below root",
    "below rear",
)  # fmt: skip


@cache
def families():
    """{name: family of a part}, what is unknown of it free."""
    found = {}
    for name in PARTS:
        free = {"contact": rom.YoungsModulus("contact", 0.1, 10.0)}
        if name == "wing":
            free |= {"E": rom.YoungsModulus("wing", 1.0, 1.0), "tape": garteur.TAPES}
        elif name == "fin":
            free["angles"] = rom.YoungsModulus("angles", 0.1, 10.0)
        elif name in ("fuselage", "tailplane"):
            free = {"E": rom.YoungsModulus(None, 1.0, 1.0)}  # a family needs one
        found[name] = garteur.reduced(
            name, free, MESH, **GIVEN | {"strip": name == "wing", "contact": CONTACT}
        )
    return found


@cache
def bed():
    """The family with its tip masses, brass and bungees, in few coordinates."""
    whole = rom.parametric.FamilyAssembly(families(), COUPLINGS, FACES)
    stiff = (2 * np.pi * 2.3) ** 2 * (sum(one.body.mass for one in families().values()) + 0.3)
    hung = {f"below {face}": GroundSpring((body, face), (0, 0, share * stiff), NONE, 10.0)
            for (body, face), share in BUNGEES.items()}  # fmt: skip
    hung["on tailplane"] = AddedMass(MIDDLE, EXTRA, NONE, 100.0)
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


def logarithms(sought, *, heavy=None, brass=0.0, bar=0.1):
    """(n_p,) of factors; one tip mass and the brass [kg], and the share of that at the ends."""
    x = dict.fromkeys(NAMES, 0.0)
    if "mass" not in sought:
        x["on tailplane"] = np.log(NONE)
    for name, value in sought.items():
        x |= dict.fromkeys(SOUGHT[name][0], value)
    for name in SOFTER:
        x[name] -= sought.get("E", 0.0)
    if heavy is not None:
        x["tip left"] = np.log(heavy / TIP)
    for face in BRASSES:
        share = 1 - bar if face == "middle" else bar / 2
        x[f"brass {face}"] = np.log(max(share * brass / BRASS, NONE))
    return np.array([x[name] for name in NAMES])


def modes(sought, **modified):
    """Frequencies (14,) [Hz], loss by that of the tape, shapes (channels, 14), by name.

    And (14, 8) the derivatives of logarithms of frequencies by what is sought.
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
            part = np.einsum("i,nij,j->n", v, model.dK / lam[one] - model.dM, v)
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
        covariance: (n, n) of these.
        misfit: chi-square of the frequencies over their number [1], before and after.
        before, after: {shape: frequency [Hz]}.
    """

    sought: dict[str, float]
    covariance: np.ndarray
    misfit: tuple[float, float]
    before: dict[str, float]
    after: dict[str, float]


def updated(measured, spread, *, free=tuple(SOUGHT), steps=8):
    """By {shape: frequency [Hz]} and the standard deviation of their logarithms: one, or each."""
    rows = [SHAPES.index(shape) for shape in measured]
    wide = np.broadcast_to(spread, len(rows))
    columns, prior = [[*SOUGHT].index(name) for name in free], [SOUGHT[name][1] for name in free]
    target, known = np.log([*measured.values()]), np.diag(np.array(prior) ** -2.0)
    x, told = np.zeros(len(free)), []
    for step in range(steps + 1):
        f, _, _, J = modes(dict(zip(free, x, strict=True)))
        r, J = (target - np.log(f[rows])) / wide, J[np.ix_(rows, columns)] / wide[:, None]
        told.append((float(r @ r / len(rows)), dict(zip(measured, f[rows], strict=True))))
        N = J.T @ J + known
        if step < steps:
            x = x + np.clip(np.linalg.solve(N, J.T @ r - known @ x), -1.0, 1.0)
    (first, before), (last, after) = told[0], told[-1]
    sought = dict(zip(free, x.tolist(), strict=True))
    return Found(sought, np.linalg.inv(N), (first, last), before, after)


# a normal law has a range of 2.06 standard deviations among four, and of 1.13 among two
RANGES = {4: 2.06, 2: 1.13}
AFTER = ("E", "wing", "root", "drums", "tail", "tape", "tips", "mass")
WITHOUT = AFTER[:-1]


def measured():
    """{shape: mean of the laboratories [Hz]}, and standard deviations of logarithms."""
    kept = tomllib.loads((record.FOUND / "garteur.toml").read_text())
    f = {shape: kept["numbers"][f"elastic, {shape} [Hz]"] for shape in SHAPES}
    ranges = [RANGES[4 if k < TESTED else 2] for k in range(len(SHAPES))]
    return f, np.array([kept["spread"][shape] / r for shape, r in zip(SHAPES, ranges, strict=True)])


@cache
def original(free=AFTER):
    """What the frequencies of the original say."""
    return updated(*measured(), free=free)


def modified(mesh, *, bar, laboratory, **directions):
    """Frequencies of the first ten shapes with brass, and with a heavy tip [Hz]; changes [%]."""
    found, values = original(), {}
    root = np.linalg.cholesky(found.covariance)
    x = np.array([*found.sought.values()]) + root @ [*directions.values()]
    sought = dict(zip(found.sought, x, strict=True))
    bare, (f, _) = modes(sought)[0], measured()
    for name, change in (("brass", {"brass": BRASS, "bar": bar}), ("heavy tip", {"heavy": 0.724})):
        ratio = modes(sought, **change)[0] / bare
        for shape, one in [*zip(SHAPES, ratio, strict=True)][:TESTED]:
            values[f"{name}, {shape} [Hz]"] = float(f[shape] * one * np.exp(laboratory))
            values[f"{name}, {shape}, change [%]"] = float(100 * (one - 1))
    return values


MODIFIED = record.Structure(
    "garteur_modified",
    modified,
    {"bar": (0.1, 0.1), "laboratory": (0.0, 0.014)}
    | {f"direction_{k}": (0.0, 2.0) for k in range(1, len(AFTER) + 1)},
    (MESH, MESH),
    """After an update by the mean of four laboratories: 0.92 kg of brass on the middle of the
tailplane, the share 'bar' of it at its ends, and 0.724 kg in place of the tip mass on the front end
of one drum. Ratios of the updated model times the mean measured before; directions are those of the
covariance of the update, 'laboratory' is the spread of the mean (logarithm). Shapes are those most
like the ones without; a heavy tip parts the two torsions into one of each wing.""",
)
