"""A body as a Python module for Exudyn, and back: ``ObjectFFRFreducedOrder``, its arrays inside.

The module needs NumPy and Exudyn, not rom. Its arrays are the integrals that Exudyn computes from
finite elements, here from those of the body; x~ is the matrix of the cross product::

    mPhitTPsi           int phi_k                mPhitTPsiTilde      int phi~_k
    mXRefTildePsi       int x~^T phi_k           mXRefTildePsiTilde  int x~^T phi~_k
    mPsiTildePsi        int phi~_j^T phi_k       mPsiTildePsiTilde   int phi~_j^T phi~_k

Its nodes are those of the surface, behind six around each interface, whose mean motion and mean
rotation are those of the interface.

Source:
    Zwoelfer and Gerstmayr, The nodal-based floating frame of reference formulation with modal
    reduction, Acta Mech. 232 (2021) 835.
"""

import base64
import io
import json
import re
import textwrap
import zipfile
import zlib
from pathlib import Path

import numpy as np

from rom.body.flexible import FlexibleBody
from rom.body.records import Surface
from rom.errors import in_file, warn
from rom.io.archive import MAX_BYTES, read_array, refuse_hostile
from rom.io.files import WRONG_JSON, check_readable, damaged, need, write_whole
from rom.io.sid.body import body_of, invariants
from rom.model import Array, Index
from rom.names import ORIGIN_MARK
from rom.rotation import crossed, skew_tensor

STAR_POINTS = np.vstack([np.eye(3), -np.eye(3)])  # nodes around an interface
MOMENTUM_RTOL = 1e-9  # share of what the momentum of a shape could be
STAR_RADIUS_RATIO = 1e-3  # of the body's size
DATA_PATTERN = re.compile(r'_decoded\("""\n([A-Za-z0-9+/=\n]*)\n"""\)')
WRONG_DATA = (*WRONG_JSON, zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError)

MODULE_TEXT = '''\
"""A flexible body for Exudyn, {mark}.

    import exudyn as exu
    import {stem}
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    body = {stem}.add(mbs, gravity=[0, 0, -9.81])
    marker = {stem}.marker(mbs, body, {stem}.INTERFACES[0])  # for joints and loads
"""

import base64
import io
import json

import numpy as np


def add(mbs, position=(0, 0, 0), rotation=None, velocity=(0, 0, 0), omega=(0, 0, 0), gravity=None):
    """Add the body: numbers of its "object", "frame" node and "modal" node.

    Frame and modal coordinates are those of the body as reduced; rotation (3, 3) takes its axes to
    the world, velocity and omega are of the world.
    """
    import exudyn as exu
    from exudyn import itemInterface as item
    from exudyn import rigidBodyUtilities as rigid

    def container(A):
        found = exu.MatrixContainer()
        found.SetWithDenseMatrix(A, useDenseMatrix=False)
        return found

    p = np.array(rigid.RotationMatrix2EulerParameters(np.eye(3) if rotation is None else rotation))
    rates = rigid.AngularVelocity2EulerParameters_t(omega, p)
    frame = mbs.AddNode(item.NodeRigidBodyEP(
        referenceCoordinates=[*position, *p], initialVelocities=[*velocity, *rates]))
    r, still = len(ARRAYS["K"]), [0.0] * len(ARRAYS["K"])
    modal = mbs.AddNode(item.NodeGenericODE2(
        numberOfODE2Coordinates=r, referenceCoordinates=still, initialCoordinates=still,
        initialCoordinates_t=still))
    known = {{name: A for name, A in ARRAYS.items() if name not in ("K", "M", "D", "triangles")}}
    known["mass"] = float(known["mass"])
    number = mbs.AddObject(item.ObjectFFRFreducedOrder(
        nodeNumbers=[frame, modal], massMatrixReduced=container(ARRAYS["M"]),
        stiffnessMatrixReduced=container(ARRAYS["K"]), dampingMatrixReduced=container(ARRAYS["D"]),
        visualization=item.VObjectFFRFreducedOrder(triangleMesh=ARRAYS["triangles"]), **known))
    if gravity is not None:
        mass = mbs.AddMarker(item.MarkerBodyMass(bodyNumber=number))
        mbs.AddLoad(item.LoadMassProportional(markerNumber=mass, loadVector=list(gravity)))
    return {{"object": number, "frame": frame, "modal": modal}}


def marker(mbs, body, interface):
    """Add a rigid marker that follows an interface: its number."""
    from exudyn import itemInterface as item

    first = 6 * INTERFACES.index(interface)
    return mbs.AddMarker(item.MarkerSuperElementRigid(
        bodyNumber=body["object"], meshNodeNumbers=list(range(first, first + 6)),
        weightingFactors=[1 / 6] * 6))


def _decoded(text):
    return base64.b64decode("".join(text.split()))


INTERFACES = json.loads(_decoded("""
{names}
"""))
ARRAYS = dict(np.load(io.BytesIO(_decoded("""
{arrays}
""")), allow_pickle=False))
'''


def write_exudyn(body: FlexibleBody, path: str | Path) -> Path:
    """Write a module that adds the body to an Exudyn system, by a name that Python can import.

    Geometric stiffness has no place in Exudyn and is left out.

    Warns:
        RomWarning: if the shapes move the mass centre, which gravity in Exudyn does not see.
    """
    path = Path(path)
    size = np.sqrt(body.mass * np.abs(body.M).max(initial=0))
    if np.abs(body.S).max(initial=0.0) > MOMENTUM_RTOL * size:
        warn(
            f"the shapes of body {body.name!r} move its mass centre; the gravity of Exudyn 1.13 "
            "turns the body as if they did not. body.with_reference('mean-axis') avoids that."
        )
    memory = io.BytesIO()
    np.savez_compressed(memory, **arrays(body))
    names = json.dumps(list(body.markers)).encode()
    stem = path.stem if path.stem.isidentifier() else "body"
    text = MODULE_TEXT.format(
        mark=ORIGIN_MARK, stem=stem, names=_encoded(names), arrays=_encoded(memory.getvalue())
    )
    return write_whole(path, text.encode())


def read_exudyn(path: str | Path) -> FlexibleBody:
    """Read a module that `write_exudyn` has written, without running it; see `rom.io.read_body`."""
    path = check_readable(path, MAX_BYTES)
    what = "this is no module for Exudyn that rom has written"
    with in_file(path), damaged(what, path, causes=WRONG_DATA):
        names, data = map(base64.b64decode, DATA_PATTERN.findall(path.read_text("utf-8")))
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            refuse_hostile(archive, MAX_BYTES)
            inside = (name.removesuffix(".npy") for name in archive.namelist())
            found = {name: read_array(archive, name, any_order=True) for name in inside}
        need(all(np.isfinite(A).all() for A in found.values()), "a number is not finite")
        return _body(path.stem, json.loads(names), found)


def _body(name: str, names: list[str], found: dict[str, Array]) -> FlexibleBody:
    r, mass, n = len(found["K"]), float(found["mass"]), 6 * len(names)
    X = found["referencePositions"].reshape(-1, 3)
    shapes = found["modeBasis"].reshape(len(X), 3, r)
    corners = found["triangles"].reshape(-1, 3).astype(np.int64) - n
    fits = corners.min(initial=0) >= 0 and corners.max(initial=-1) < len(X) - n
    need(fits and len(set(names)) == len(names), "its nodes are not those of its names")
    stars = zip(names, X[:n].reshape(-1, 6, 3), shapes[:n].reshape(-1, 6, 3, r), strict=True)
    known = {
        "Inv3": found["mPhitTPsi"].reshape(3, r),
        "Inv8": found["mXRefTildePsiTilde"].reshape(3, r, 3),
        "Inv9": -found["mPsiTildePsiTilde"].reshape(r, 3, r, 3).swapaxes(0, 1),
    }
    rigid = mass, mass * found["centerOfMass"].reshape(3), found["inertia"].reshape(3, 3)
    matrices = (found[matrix].reshape(r, r) for matrix in "KDM")
    surface = Surface(X[n:], corners, shapes[n:].reshape(-1, r)) if len(X) > n else None
    nodes = {name: _middle(x, u) for name, x, u in stars}
    return body_of(name, rigid, known, *matrices, nodes=nodes, surface=surface)


def _middle(points: Array, shapes: Array) -> tuple[Array, Array, Array]:
    """Point (3,), translation and rotation (3, r) of six nodes around an interface."""
    point, moved = points.mean(axis=0), shapes.mean(axis=0)
    arms = points - point
    turned = crossed(np.einsum("na,nbk->abk", arms, shapes - moved))
    return point, moved, 1.5 * turned / np.square(arms).sum()


def arrays(body: FlexibleBody) -> dict[str, Array | Index]:
    """Arrays by the names of Exudyn's arguments, and K, M, D, triangles."""
    r, integrals = body.n_modes, invariants(body)
    return {
        "K": body.K,
        "M": body.M,
        "D": body.D,
        "mass": np.array(body.mass),
        "inertia": body.inertia,
        "centerOfMass": body.first_moment / body.mass,
        "mPhitTPsi": body.S,
        "mPhitTPsiTilde": np.einsum("abc,ck->akb", skew_tensor(), body.S).reshape(3, 3 * r),
        "mXRefTildePsi": -integrals["Inv4"],
        "mXRefTildePsiTilde": integrals["Inv8"].reshape(3, 3 * r),
        "mPsiTildePsi": -integrals["Inv5"].swapaxes(0, 1).reshape(3 * r, r),
        "mPsiTildePsiTilde": -integrals["Inv9"].swapaxes(0, 1).reshape(3 * r, 3 * r),
        **_nodes(body),
    }


def _nodes(body: FlexibleBody) -> dict[str, Array | Index]:
    points, modes = [np.zeros((0, 3))], [np.zeros((0, body.n_modes))]
    arms = STAR_RADIUS_RATIO * body.size * STAR_POINTS
    for m in body.markers.values():
        points.append(m.point + arms)
        turned = np.einsum("abc,ck,nb->nak", skew_tensor(), m.rotation, arms)
        modes.append((m.translation + turned).reshape(18, -1))
    triangles: Index = np.zeros((0, 3), dtype=np.int64)
    if body.surface is not None:
        points.append(body.surface.points)
        modes.append(body.surface.shape)
        triangles = body.surface.triangles + 6 * len(body.markers)
    return {
        "referencePositions": np.vstack(points).ravel(),
        "modeBasis": np.vstack(modes),
        "triangles": triangles,
    }


def _encoded(data: bytes) -> str:
    return "\n".join(textwrap.wrap(base64.b64encode(data).decode(), 96))
