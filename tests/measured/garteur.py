"""The test bed like an aircraft, GARTEUR SM-AG19: solids in parts, joined by contacts."""

import warnings
from dataclasses import replace
from functools import cache, partial

import numpy as np
from measured.record import PREDICTED, Structure
from scipy.linalg import eigh
from scipy.optimize import linear_sum_assignment

import rom
from cases.paths import ROOT
from rom.components.updating.family_model import Parts
from rom.updating import AddedMass, Channels, GroundSpring

PARTS = {  # number in the geometry, region of aluminium
    "fuselage": (1, "fuselage"), "wing": (2, "wing"), "left": (3, "drum"), "right": (4, "drum"),
    "fin": (5, "fin"), "tailplane": (6, "tailplane"),
}  # fmt: skip
COUPLINGS = (
    (("fuselage", "root"), ("wing", "root")),
    (("wing", "left"), ("left", "root")),
    (("wing", "right"), ("right", "root")),
    (("fuselage", "foot"), ("fin", "foot")),
    (("fin", "top"), ("tailplane", "top")),
)
ORDERS = {"root": 3, "left": 3, "right": 3, "foot": 2, "top": 2}  # of polynomials on faces
FACES = rom.Polynomial(3)
STEEL = rom.Material(E=206e9, nu=0.3, rho=7850.0)
GAP = 2e-4  # thickness of contacts [m]
DENSITY = 2740.0  # of aluminium [kg/m^3]
TAPE, POWER = 0.55e6, 0.5  # shear modulus of the tape at 10 Hz [Pa]; it grows with the frequency
TIPS = (("left", "tip"), ("right", "tip"))
BUNGEES = {("wing", "root"): 2 / 3, ("fuselage", "rear"): 1 / 3}  # of the stiffness
TAPES = rom.YoungsModulus("tape", 0.1, 10.0)
MODES, SUSPENDED = (
    60,
    4.0,
)  # of the assembly for each stiffness of the tape; below so many Hz it hangs as if rigid

SHAPES = (  # in the order of the copy with elastic contacts
    "two-node bending", "fuselage rotation", "three-node bending", "antisymmetric torsion",
    "symmetric torsion", "four-node bending", "in plane, fuselage turns", "in plane, symmetric",
    "five-node bending", "tailplane yaws", "fuselage bends sideways", "tailplane rolls",
    "six-node bending", "seven-node bending",
)  # fmt: skip
WING, DRUM, TAIL, X, Y, Z = 0.1012, 0.1114, 0.3854, *np.eye(3)
PLACES = [  # where shapes are compared, near the places of accelerometers
    *(((0.0, y, WING), Z) for y in (-0.88, -0.6, -0.3, 0.3, 0.6, 0.88)),
    *(((x, y, DRUM), Z) for x in (-0.19, 0.19) for y in (-0.95, 0.95)),
    *(((0.2, y, DRUM), X) for y in (-0.95, 0.95)), *(((-0.8, y, TAIL), X) for y in (-0.19, 0.19)),
    *(((-0.85, y, TAIL), Z) for y in (-0.19, 0.19)), ((-0.85, 0.19, TAIL), Y),
    ((0.6, 0, 0), Y), ((-0.9, 0, 0), Y), ((0.59, 0, 0.075), Z), ((-0.9, 0, -0.05), Z),
]  # fmt: skip


@cache
def part(name, mesh, strip, contact, E, rho, t, b):  # noqa: PLR0913  what changes a part
    """A part, or of a wing with a strip the family of its tape; mesh: size in mm."""
    free = {"tape": TAPES} if strip else {}
    return reduced(name, free, mesh, strip=strip, contact=contact, E=E, rho=rho, t=t, b=b)


def reduced(name, free, mesh, *, strip, contact, E, rho, t, b):  # noqa: PLR0913
    """A body, or a family by what is free; a stiffness of contacts of zero: glued."""
    from mpi4py import MPI

    number, region = PARTS[name]
    solid, layer = rom.Material(E, 0.33, rho), rom.Material(2.98 * TAPE, 0.49, 1000.0)
    glued = rom.Material(contact * GAP, 0.0, rho) if contact else solid
    other = {"plate": STEEL, "angles": STEEL, "contact": glued, "tape": layer, "strip": solid}
    here = {"fuselage": ("plate",), "wing": ("contact", *("tape", "strip") * strip),
            "fin": ("angles", "contact"), "tailplane": ()}.get(name, ("contact",))  # fmt: skip
    sizes = {"part": number, "strip": int(strip), "t": t, "b": b, "gap": GAP, "lc": 1e-3 * mesh}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # thin layers have slender cells
        model = rom.fe.model(
            ROOT / "meshes" / "garteur.geo", parameters=sizes, comm=MPI.COMM_SELF,
            material={region: solid} | {key: other[key] for key in here},
        )  # fmt: skip
        kinds = {face: rom.Polynomial(ORDERS[face]) if face in ORDERS else "rbe3"
                 for face in model.interfaces}  # fmt: skip
        how = {"method": rom.CraigBampton(16), "interfaces": kinds, "certify": False, "name": name}
        return (
            rom.reduce_parametric(model, parameters=free, **how)
            if free
            else rom.reduce(model, **how)
        )


def bed(mesh, *, strip, contact, E, rho, t, b):
    """The assembly of the parts, and (r, r) the stiffness of the tape by the wing's coordinates."""
    found = {
        name: part(name, mesh, strip and name == "wing", contact, E, rho, t, b) for name in PARTS
    }
    tape = 0.0
    if strip:
        family = found["wing"]
        (tape,) = (share.K for share in family.shares if share.region == "tape")
        found["wing"] = replace(family.body, K=sum(share.K for share in family.shares))
    return rom.Assembly(found, COUPLINGS, FACES), tape


def spectrum(assembly, tape, *, heave, masses=(), factor=1.0, n=18):
    """Frequencies [Hz], loss by that of the tape [1], and shapes {body: (6 + r, n)}.

    It hangs on bungees with that frequency of heave [Hz]; masses are {place: kg}.
    """
    omega, shapes = assembly.modes()
    V, whole = np.vstack([*shapes.values()]), Parts.of(assembly)
    total = sum(body.mass for body in assembly.bodies.values())
    U = shapes["wing"][6:]
    T = U.T @ (tape * np.eye(len(U)) if np.isscalar(tape) else tape) @ U
    Q = np.hstack([eigh(np.diag(omega**2) + (g - 1) * T, subset_by_index=(0, MODES - 1))[1]
                   for g in (0.3, 1.0, 3.0, 9.0) if g == 1.0 or T.any()])  # fmt: skip
    Q = np.linalg.qr(Q)[0]
    V, T, K, M = V @ Q, Q.T @ T @ Q, Q.T @ (omega[:, None] ** 2 * Q), np.eye(Q.shape[1])
    stiff = (2 * np.pi * heave) ** 2 * (total + sum(dict(masses).values()))
    for place, share in BUNGEES.items():
        spring = GroundSpring(place, (0.0, 0.0, share * stiff), 1.0, 1.0)
        K += V.T @ spring.term(whole)[0] @ V
    for place, mass in dict(masses).items():
        M += V.T @ AddedMass(place, mass, 1.0, 1.0).term(whole)[1] @ V
    first = int(np.count_nonzero(eigh(K, M, eigvals_only=True) < (2 * np.pi * SUSPENDED) ** 2))
    f, loss, found = np.zeros(n), np.zeros(n), np.zeros((len(K), n))
    for k in range(n):
        f[k] = 20.0
        for _ in range(4):  # the tape as stiff as it is at this frequency
            g = factor * (f[k] / 10.0) ** POWER
            lam, W = eigh(K + (g - 1) * T, M, subset_by_index=(first + k, first + k))
            f[k], found[:, k] = np.sqrt(lam[0]) / 2 / np.pi, W[:, 0]
            if not T.any():
                break
        loss[k] = g * found[:, k] @ T @ found[:, k] / lam[0]
    moved = V @ found
    return f, loss, {name: moved[at] for name, at in whole.columns.items()}


def seen(assembly, shapes):
    """(channels, n) of shapes, of length one."""
    rows = Channels(*map(np.array, zip(*PLACES, strict=True))).rows(assembly.bodies, "place", 0.03)
    U = rows @ np.vstack([*shapes.values()])
    return U / np.linalg.norm(U, axis=0)


@cache
def reference(strip):
    """(channels, 14) shapes by name, with elastic contacts, of the copy or of the bed; a file."""
    kept = np.loadtxt(PREDICTED / "garteur_shapes.csv", delimiter=",").T
    return kept[:, len(SHAPES) :] if strip else kept[:, : len(SHAPES)]


def reference_anew(strip):
    """The same without the file."""
    whole = bed(50, strip=strip, contact=10**11.5, E=71e9, rho=DENSITY, t=0.010, b=0.035)
    masses = dict.fromkeys(TIPS, 0.175) if strip else {}
    U = seen(whole[0], spectrum(*whole, heave=2.3, masses=masses, n=len(SHAPES))[2])
    return U if not strip else U[:, paired(reference(False), U)]


def paired(known, U):
    """(k,) columns of U that are most like the known ones, one each."""
    return linear_sum_assignment((known.T @ U) ** 2, maximize=True)[1]


def frequencies(mesh, *, strip, E, t, b, contact, heave, tips=0.0, tape=0.0, loss=0.0, other=0.0):  # noqa: PLR0913
    """Of parts glued and joined by elastic contacts [Hz]; damping of the latter [%]."""
    found, masses = {}, dict.fromkeys(TIPS, tips) if tips else {}
    for joint, stiff in (("glued", 0.0), ("elastic", 10**contact)):
        whole = bed(mesh, strip=strip, contact=stiff, E=E, rho=DENSITY, t=t, b=b)
        f, share, shapes = spectrum(*whole, heave=heave, masses=masses, factor=10**tape)
        order = paired(reference(strip), seen(whole[0], shapes))
        named = [*zip(SHAPES, order, strict=True)]
        found |= {f"{joint}, {shape} [Hz]": float(f[k]) for shape, k in named}
    if strip:
        damping = 50 * loss * share + other
        found |= {f"damping, {shape} [%]": float(damping[k]) for shape, k in named}
    return found


SPREADS = {
    "E": (71e9, 2.4e9), "t": (0.010, 1e-4), "b": (0.035, 0.01), "contact": (11.5, 0.5),
    "heave": (2.3, 0.7),
}  # fmt: skip
NOTE = """Aluminium of 2740 kg/m3; the spread of E is that of density, too. A steel plate 130 x 70
x 16 mm lies between fuselage and wing, its half-width b uncertain; steel angles hold the fin, its
rear edge flush with the tail. Faces are glued, or joined by contacts of 10^contact N/m3 (half of it
along the faces), a guess of bolted faces, within a factor of 3. Bungees act at the wing root (two
thirds) and 290 mm behind it, with that frequency of heave. No accelerometers, cables, brackets."""
COPY = Structure("garteur_copy", partial(frequencies, strip=False), SPREADS, (50, 25), NOTE)
ORIGINAL = Structure(
    "garteur",
    partial(frequencies, strip=True),
    SPREADS | {"tips": (0.175, 0.025), "tape": (0.0, 0.3), "loss": (1.0, 0.3), "other": (0.3, 0.3)},
    (50, 25),
    f"""{NOTE} Tip masses hang as points on the front ends of the drums. The strip is flush with the
rear edge of the wing. The tape has a shear modulus of 0.55 MPa at 10 Hz, growing with the root of
the frequency, within a factor of 2 (10^tape), and that loss factor; what else damps is 'other'.""",
)
