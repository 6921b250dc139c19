"""The stages of a reduction to a flexible body, one after the other."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from rom.body.damping import damped
from rom.body.prestress import UnitLoads
from rom.body.projection import (
    canonical_columns,
    elastic_part,
    flexible_body,
    stress_recovery,
    stressed_nodes,
)
from rom.body.recovery import residual_motion
from rom.checks.draft import Draft
from rom.errors import InterfaceError
from rom.model import BUCKLING_LOADS
from rom.process.progress import MANY_DOFS
from rom.process.progress import stages as progress
from rom.reduction.bases.assumed import supported_by
from rom.reduction.bases.method import judged_in
from rom.reduction.interfaces.connection import connect as connected
from rom.reduction.interfaces.order import with_orders


def choose_orders(draft: Draft) -> None:
    """Give polynomials whose order is open the lowest one that is accurate enough."""
    draft.watch.begin("interfaces")
    found = with_orders(draft.ops, draft.model, draft.interfaces, draft.method)
    draft.interfaces, draft.method = found


def connect(draft: Draft) -> None:
    """Write the model in the coordinates of its interfaces."""
    draft.watch.begin("interfaces")
    draft.connection = connected(draft.ops, draft.model, draft.interfaces)
    draft.maker = draft.method
    size = draft.connection.boundary.size
    draft.say("reduce %d dofs to %d interface coordinates", draft.ops.n, size)


def few_functions(draft: Draft) -> None:
    """Let full interfaces follow characteristic constraint modes."""
    draft.interfaces = draft.method.kinds(draft.connection, draft.interfaces)
    draft.connection = connected(draft.ops, draft.model, draft.interfaces)
    draft.maker = draft.method.method
    draft.say("full interfaces follow %d coordinates", draft.connection.boundary.size)


def obey_reference(draft: Draft) -> None:
    """Hold assumed modes as the reference condition does."""
    origins = {name: draft.model.interfaces[name].origin for name in draft.connection.parts}
    asked = draft.maker.fixed
    fixed = supported_by(draft.reference, origins) if asked is None else asked
    draft.maker = replace(draft.maker, held=draft.connection.held(fixed))


def basis(draft: Draft) -> None:
    """Find the shapes of the method."""
    draft.watch.begin("shapes")
    connection = draft.connection
    method = judged_in(draft.maker, tuple(connection.parts.values()))
    with at_work(draft, f"shapes of {draft.ops.n} dofs", 0):
        draft.basis = method.basis(connection.ops, connection.boundary, connection.labels)


def project(draft: Draft) -> None:
    """Split the shapes into rigid motions and free modes, by their energies."""
    draft.watch.begin("energies")
    with at_work(draft, f"energies of {draft.basis.Psi.shape[1]} shapes", 1):
        draft.Psi = draft.connection.ops.expand(draft.basis.Psi)
        draft.elastic = elastic_part(draft.ops, draft.Psi, draft.basis.labels)


def make_body(draft: Draft) -> None:
    """Integrate the inertia of the shapes, and mark the interfaces: a body on its mean axes."""
    draft.watch.begin("body")
    draft.E = canonical_columns(draft.bare, draft.Psi @ draft.elastic.V, draft.model)
    made = {"name": draft.name, "ties": draft.connection.ties}
    made["provenance"] = draft.model.provenance | {"reduction": _described(draft)}
    draft.body = flexible_body(draft.model, draft.bare, draft.E, draft.elastic.omega, **made)


def recover(draft: Draft) -> None:
    """Make the stress on the surface recoverable, with that of the modes left out."""
    stressed_nodes(draft.model)  # refuses a model without finite elements
    holds = {name: marker.hold for name, marker in draft.body.markers.items()}
    missing = residual_motion(draft.ops, draft.connection, draft.basis, holds, draft.model.points)
    draft.body = replace(draft.body, stress=stress_recovery(draft.model, draft.E, missing))


def stiffen(draft: Draft) -> None:
    """Give the body the geometric stiffness of its unit loads."""
    loads = UnitLoads(draft.model, draft.bare, draft.ops, draft.connection)
    K_geo = loads.geometric_stiffness(draft.E, draft.body.markers)
    draft.body = replace(draft.body, K_geo=K_geo)


def press(draft: Draft) -> None:
    """Tell a body without geometric stiffness which forces between interfaces buckle it."""
    loads = UnitLoads(draft.model, draft.bare, draft.ops, draft.connection)
    found = loads.buckling_loads(draft.E, draft.elastic.omega, draft.body.markers)
    draft.body.provenance[BUCKLING_LOADS] = found


def place_frame(draft: Draft) -> None:
    """See the body from the frame of the reference condition."""
    draft.body = draft.body.with_reference(draft.reference)


def damp(draft: Draft) -> None:
    """Give the body its structural damping."""
    draft.body = damped(draft.body, draft.damping)


@contextmanager
def at_work(draft: Draft, label: str, begun: int) -> Iterator[None]:
    """Around one of two long stages: say how far it is, and which interfaces an error is about."""
    try:
        with progress(2, begun, long=draft.ops.n > MANY_DOFS) as begin:
            begin(label)
            yield
    except InterfaceError as error:  # the reduction knows of dofs alone
        error.where = error.where or f"interfaces {', '.join(draft.interfaces)}"
        raise


def _described(draft: Draft) -> dict[str, object]:
    found = draft.basis
    alone = all(re.fullmatch(r"(rigid|free) \d+", label) for label in found.labels)
    return {
        "method": repr(draft.method),
        "full dofs": draft.ops.n,
        "columns": list(found.labels),
        "static shapes": not alone,
        "frequencies of the modes kept [Hz]": (found.omega / (2 * np.pi)).tolist(),
    }
