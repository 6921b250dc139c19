"""Material numbers as coefficients of the forms, and what a careful user wants to know of them."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from ufl.core.expr import Expr

from rom.errors import MaterialError, TagError
from rom.fe.compat import per_cell
from rom.model import PAIRS, Array, Index, Material, Orthotropic
from rom.names import check_known, named
from rom.plausible import FOAM_SPEED

Solid = Material | Orthotropic
Coefficients = dict[str, fem.Constant] | dict[str, fem.Function]
MAX_PLAUSIBLE_SIZE = 20.0  # [m]; most machine parts above it are millimetres read as metres
NEARLY_INCOMPRESSIBLE = 0.49
MAX_STIFFNESS_RATIO = 1e8  # beyond it, conditioning costs half the digits


def by_region(material: Solid | Mapping[str, Solid], regions: dict[str, int]) -> dict[int, Solid]:
    """{tag: material}, from one material for all or from {region name: material}."""
    if isinstance(material, Solid):
        return dict.fromkeys(regions.values(), material)
    if not isinstance(material, dict):
        raise MaterialError(
            f"material = {material!r} must be a Material, Orthotropic or dictionary."
        )
    for name, value in material.items():
        check_known(name, regions, f"there is no region {name!r}; the mesh has", MaterialError)
        if not isinstance(value, Solid):
            raise MaterialError(f"material[{name!r}] = {value!r} must be a rom.Material.")
    if missing := sorted(set(regions) - set(material)):
        raise TagError(
            f"the region {named(missing)} has no material; materials are given for "
            f"{sorted(material)}.",
            hint="Give every region of the mesh a material.",
        )
    return {regions[name]: value for name, value in material.items()}


def coefficients(mesh: Mesh, tags: Index, solids: dict[int, Solid]) -> Coefficients:
    """Coefficients of the forms: "rho", and "lam", "mu" or the full stiffness "C".

    Constants for one material, one value per cell, which has a region's tag, for several, so that
    other numbers never mean another compilation.
    """
    tables = {tag: _numbers(solid, _isotropic(solids)) for tag, solid in solids.items()}
    if len(set(map(id, solids.values()))) == 1:
        return {
            name: fem.Constant(mesh, value) for name, value in next(iter(tables.values())).items()
        }
    order = sorted(tables)
    rows = np.searchsorted(order, tags)
    names = tables[order[0]]
    return {n: per_cell(mesh, np.array([tables[t][n] for t in order])[rows]) for n in names}


def of_region(mesh: Mesh, tags: Index, solids: dict[int, Solid], tag: int) -> Coefficients:
    """Coefficients that vanish outside one region, one value per cell; see `coefficients`."""
    inside = tags == tag
    return {
        name: per_cell(mesh, np.multiply.outer(inside, value))
        for name, value in _numbers(solids[tag], _isotropic(solids)).items()
    }


def _isotropic(solids: dict[int, Solid]) -> bool:
    return all(isinstance(solid, Material) for solid in solids.values())


def _numbers(solid: Solid, isotropic: bool) -> dict[str, Array]:
    C, rho = solid.stiffness, np.array(solid.rho, dtype=np.float64)
    return {"rho": rho, "lam": C[0, 1], "mu": C[3, 3]} if isotropic else {"rho": rho, "C": C}


def stress(strain: Expr, numbers: Coefficients) -> Expr:
    """Stress of Hooke's law, isotropic or with the (6, 6) stiffness C, of a ufl strain (3, 3)."""
    if "C" not in numbers:
        return 2 * numbers["mu"] * strain + numbers["lam"] * ufl.tr(strain) * ufl.Identity(3)
    e = strain
    voigt = ufl.as_vector([e[0, 0], e[1, 1], e[2, 2], 2 * e[1, 2], 2 * e[0, 2], 2 * e[0, 1]])
    s = ufl.dot(numbers["C"], voigt)
    return ufl.as_matrix([[s[0], s[5], s[4]], [s[5], s[1], s[3]], [s[4], s[3], s[2]]])


def stiffness(numbers: Coefficients, x: Expr) -> Expr:
    """The (6, 6) stiffness row by row, a ufl vector of the mesh."""
    rows = []
    for a, b in PAIRS:
        unit = np.zeros((3, 3))
        unit[a, b] = unit[b, a] = 1.0 if a == b else 0.5
        s = stress(ufl.as_matrix(unit.tolist()), numbers)
        rows += [s[i, j] + 0 * x[0] for i, j in PAIRS]
    return ufl.as_vector(rows)


def geometric_stiffness(u: Expr, v: Expr, sigma: Expr) -> Expr:
    """Density of the stiffness that a stress gives to displacements u and v, a ufl expression.

    Second variation of the work of the stress on the engineering strain U - 1, with U the stretch
    of F = R U: sigma : (grad u^T grad v - eps(u) eps(v)). Green's strain has the first term alone;
    by it a pulled bar is stiffer against more pull by sigma / E, which Hooke's law does not say.

    Source:
        Biot, Mechanics of Incremental Deformations, Wiley (1965), chapter 2.
    """
    turned = ufl.inner(ufl.dot(ufl.grad(u), sigma), ufl.grad(v))
    stretched = ufl.inner(ufl.dot(ufl.sym(ufl.grad(u)), sigma), ufl.sym(ufl.grad(v)))
    return turned - stretched


def doubts(solids: dict[str, Solid], size: float, cell: str, degree: int) -> Iterator[str]:
    """Sentences about legal but unusual {region: material}, and the longest edge of the box [m]."""
    if degree == 1 and cell == "tetrahedron":
        yield (
            "linear tetrahedra lock in bending: frequencies come out too high, often by tens of "
            "per cent. Use degree=2."
        )
    for name, solid in solids.items():
        if not solid.doubt and solid.wave_speed > FOAM_SPEED and size > MAX_PLAUSIBLE_SIZE:
            yield (
                f"the body is {size:.4g} m long and as stiff as metal. If the mesh is in "
                "millimetres, give scale=1e-3."
            )
        if isinstance(solid, Material) and solid.nu > NEARLY_INCOMPRESSIBLE:
            yield (
                f"nu = {solid.nu:g} in {name!r} is nearly incompressible: displacement elements "
                "come out too stiff. Stay below 0.49."
            )
    stiffness = [np.linalg.eigvalsh(solid.stiffness) for solid in solids.values()]
    contrast = max(s[-1] for s in stiffness) / min(s[0] for s in stiffness)
    if contrast > MAX_STIFFNESS_RATIO:
        yield f"stiffness varies by {contrast:.1g} over the body; expect few correct digits."


def described(solids: dict[str, Solid]) -> dict[str, object]:
    """The material numbers by region, in plain Python, for the provenance."""
    return {name: _plain(asdict(solid)) for name, solid in solids.items()}


def _plain(value: object) -> object:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return np.asarray(value, dtype=float).tolist()
