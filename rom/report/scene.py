"""What a page draws in space: bodies, their shapes, and modes or a motion, small enough to send.

A scene is a dictionary for JSON, numbers in base 64; that of a run is a file beside its table, so
that a report needs neither body nor solver. Flexible bodies keep their elastic coordinates: the
page computes the place of a point from x = r + A (X + S q), as the integrator.
"""

import json
from base64 import b64decode
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

import rom.body
import rom.mbs
from rom.arguments import finite, positive
from rom.body.records import Surface
from rom.body.recovery import StressRecovery, von_mises
from rom.errors import ConfigError
from rom.io.files import WRONG_JSON, check_readable, damaged, need, write_whole
from rom.model import Array, Index
from rom.report.coarse import TYPES, array, coarsened, corners, quantised_column, quantised_points
from rom.rotation import matrix
from rom.view.canvas.scene import aimed, sharp_edges
from rom.view.canvas.solids import Mesh
from rom.view.figures.things import COLOURS
from rom.view.scenes.film import METAL_COLOURS, shades_of
from rom.view.scenes.mode_shapes import AMPLITUDE_RATIO, displacement
from rom.view.scenes.places import evenly, placed
from rom.view.scenes.rigid import Form, check_bodies, form_of

SCHEMA_NAME, SCHEMA_VERSION = "rom-scene", [1, 0]
SHAPE_BYTES = 1_300_000  # of all shapes and stresses of a scene
MOTION_BYTES = 1_000_000  # of all poses and elastic coordinates of a scene
MIN_POINTS, MAX_POINTS = 500, 20_000  # of one surface
N_FRAMES = 600  # of a motion
N_MODES = 6  # shown of a body that was compared with no mesh
N_COORDINATES = 40  # elastic coordinates that are shown one by one
SMALLEST_SHARE = 1e-4  # of a displacement or stress: coordinates that add less are left out
FRAMES_AT_ONCE = 50  # while limits of colours are looked for
ELASTIC_COLOURS = ("#2f7f9f", "#d1495b", "#edae49", "#66a182")
Scene = dict[str, Any]  # for JSON
FACE_COLOUR = "#c9d0d8"  # of a face that is not chosen
NO_TURN = np.array([[1.0, 0.0, 0.0, 0.0]])
MAX_BYTES = 50_000_000  # of a file that is still read
KEYS: dict[str, type] = dict.fromkeys(("size", "magnify", "start"), float)
KEYS |= {"view": dict, "limits": dict, "title": str, "bodies": list, "modes": list}
VIEW_KEYS = {"toward": 3, "up": 3, "radius": 0, "tall": 0, "wide": 0}  # and how many numbers


@dataclass(frozen=True, slots=True)
class Thing:
    """A body in a scene, at f instants, with r elastic coordinates, of a rigid body none."""

    name: str
    colour: str  # where it has no field, "#rrggbb"
    points: Array  # (s, 3) undeformed, body frame [m]
    triangles: Index  # (t, 3) corners
    position: Array  # (f, 3) origin of its frame [m]
    orientation: Array  # (f, 4) quaternion of its frame
    shapes: Array = field(default_factory=lambda: np.zeros((0, 0)))  # (3 s, r) displacements
    stress: Array = field(default_factory=lambda: np.zeros((0, 0)))  # (6 s, r) per unit of q [Pa]
    q: Array = field(default_factory=lambda: np.zeros((1, 0)))  # (f, r) elastic coordinates

    def corners(self) -> Array:
        """(8 f, 3) of the box around the undeformed points, in the world."""
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        box = np.array([np.where(np.array(k) > 0, high, low) for k in np.ndindex(2, 2, 2)])
        turned = np.array([matrix(p) for p in self.orientation])
        return placed(box[None], (self.position, turned)).reshape(-1, 3)


def modes_scene(body: "rom.body.FlexibleBody", *, size: int = SHAPE_BYTES) -> Scene:
    """The modes of a body by support, and its elastic coordinates, in about ``size`` bytes."""
    body = body.in_units("SI")
    surface, stress, found = _surface(body), _stress(body), list(_modes(body))
    if surface is None:
        raise ConfigError(f"body {body.name!r} carries no surface; only meshed ones are drawn.")
    Q = np.array([mode["q"] for mode in found]).reshape(len(found), -1)
    moved = (displacement(body, np.r_[mode["rigid"], mode["q"]]) for mode in found)
    far = [float(np.abs(u).max()) for u in moved]
    shown = np.arange(min(body.n_modes, N_COORDINATES))
    kept = np.union1d(_felt(surface.shape, stress, Q, np.array(far)), shown).astype(int)
    for mode, unit in zip(found, far, strict=True):
        mode["rigid"] = [float(f"{x / unit:.7g}") for x in mode["rigid"]]
        mode["q"] = [float(f"{x / unit:.7g}") for x in mode["q"][kept]]
    mesh, still = (surface.points, surface.triangles), (np.zeros((1, 3)), NO_TURN)
    shapes, q = surface.shape[:, kept], np.zeros((1, len(kept)))
    thing = Thing(body.name, ELASTIC_COLOURS[0], *mesh, *still, shapes, stress[:, kept], q)
    coordinates = [
        {"group": "Elastic coordinates", "label": f"q{k + 1}: {f:.5g} Hz", "coordinate": k}
        for k, f in enumerate(body.omega[:N_COORDINATES] / (2 * np.pi))
    ]
    scene = _scene(f"Mode shapes of {body.name}", [thing], size, {"magnify": AMPLITUDE_RATIO})
    return scene | {"modes": found + coordinates}


def motion_scene(
    solution: "rom.mbs.Solution",
    *,
    title: str = "Motion",
    shapes: dict[str, Mesh] | None = None,
    magnify: float = 1.0,
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
    size: int = SHAPE_BYTES,
) -> Scene:
    """A motion, as of `rom.view.animate`, but ``up`` None is against gravity; size as above."""
    mechanism = solution.mechanism
    given = _meshes(shapes or {}, mechanism)
    positive("magnify", magnify)
    steps = _steps(solution)
    things, shades, elastic = [], shades_of(mechanism), cycle(ELASTIC_COLOURS)
    for name, part in mechanism.parts.items():
        pose = solution.position(name)[steps], solution.orientation(name)[steps]
        form = form_of(mechanism, name, given)
        colour = METAL_COLOURS[shades[name]] if form.surface is None else next(elastic)
        q = solution.elastic(name)[steps] if part.r else None
        things.append(_of_part(part, colour, form, pose, q))
    limits, t = [_limits(thing) for thing in things], solution.t[steps]
    keys = "displacement", "stress"
    largest = {key: max((one[key] for one in limits), default=0.0) for key in keys}
    look = {"view": view, "up": up, "gravity": mechanism.gravity, "magnify": magnify}
    scene = _scene(title, things, size, look)
    return scene | {"times": array(t - t[0], "float32"), "start": float(t[0]), "limits": largest}


def start_scene(
    mechanism: "rom.mbs.Mechanism",
    *,
    title: str = "Mechanism at its start",
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> Scene:
    """A mechanism as its bodies are placed; arguments as of `rom.view.mechanism`."""
    things = [
        _of_part(part, colour, form_of(mechanism, name, {}), (part.at[None], part.p[None]), None)
        for (name, part), colour in zip(mechanism.parts.items(), cycle(COLOURS), strict=False)
    ]
    look = {"view": view, "up": up, "gravity": mechanism.gravity}
    return _scene(title, things, SHAPE_BYTES, look)


def faces_scene(points: Array, patches: Mapping[str, Index], *, title: str) -> Scene:
    """Faces of a part, to be clicked, from points (n, 3) [m] and {name: (t, 3) triangles}.

    The name "" stands for the rest of the surface.
    """
    things = []
    for name, triangles in patches.items():
        if len(triangles):
            used, corner = np.unique(triangles, return_inverse=True)
            mesh = points[used], corner.reshape(-1, 3)
            things.append(Thing(name, FACE_COLOUR, *mesh, np.zeros((1, 3)), NO_TURN))
    return _scene(title, things, SHAPE_BYTES, {}) | {"pick": True}


def _meshes(shapes: dict[str, Mesh], mechanism: "rom.mbs.Mechanism") -> dict[str, Mesh]:
    """The shapes of bodies, if the mechanism has these and the triangles have their corners."""
    check_bodies(mechanism, "shapes", shapes)
    found = {}
    for name, (points, triangles) in shapes.items():
        X, corner = np.asarray(points, dtype=float), np.asarray(triangles)
        fit = X.ndim == corner.ndim == 2 and X.shape[1] == corner.shape[1] == 3 and corner.size
        fit = fit and np.isfinite(X).all() and corner.dtype.kind in "iu"
        if not fit or corner.min() < 0 or corner.max() >= len(X):
            what = "(n, 3) points and (t, 3) corners from 0 to n - 1"
            raise ConfigError(f"the shape of {name!r} must be {what}.")
        found[name] = X, corner.astype(np.int64)
    return found


def _surface(body: object) -> Surface | None:
    surface: Surface | None = getattr(body, "surface", None)
    return surface if surface is not None and len(surface.triangles) else None


def _stress(body: "rom.body.FlexibleBody") -> Array:
    """(6 s or 0, r) stress on the points of the surface, where the body has it and it is linear."""
    surface, recovery = _surface(body), body.stress
    if surface is not None and isinstance(recovery, StressRecovery):
        if recovery.points.shape == surface.points.shape:
            return recovery.operator
    return np.zeros((0, body.n_modes))


def _modes(body: "rom.body.FlexibleBody") -> Iterator[Scene]:
    """The modes whose frequencies a report lists, support by support."""
    compared = body.provenance.get("comparison", {})
    supports = {"free": ()} | {f"{name} held": (name,) for name in body.markers}
    for support, fixed in supports.items():
        n = len(compared.get(support, {}).get("full", ()))
        if not (n or (not fixed and not compared)):
            continue
        omega, V = body.modes(fixed=fixed)
        for i, k in enumerate(np.flatnonzero(omega > 0)[: n or N_MODES]):
            label = f"{support}, mode {i + 1}: {omega[k] / (2 * np.pi):.5g} Hz"
            group = support if fixed else support.capitalize()
            yield {"group": group, "label": label, "rigid": V[:6, k], "q": V[6:, k]}


def _felt(shapes: Array, stress: Array, Q: Array, far: Array) -> Index:
    """Elastic coordinates that are seen in a state of Q (m, r) whose displacement is far (m,)."""
    seen = np.abs(Q) * np.abs(shapes).max(axis=0) > SMALLEST_SHARE * far[:, None]
    if stress.size:
        parts = np.abs(Q) * np.abs(stress).max(axis=0)
        seen |= parts > SMALLEST_SHARE * parts.max(axis=1, initial=0.0)[:, None]
    return np.flatnonzero(seen.any(axis=0))


def _steps(solution: "rom.mbs.Solution") -> Index:
    per_frame = 4 * sum(7 + part.r for part in solution.mechanism.parts.values())
    n = int(np.clip(MOTION_BYTES // max(per_frame, 1), 2, N_FRAMES))
    return np.unique(evenly(len(solution.t), n))


def _of_part(
    part: "rom.mbs.Part", colour: str, form: Form, pose: tuple[Array, Array], q: Array | None
) -> Thing:
    mesh, surface = (form.points, form.triangles), form.surface
    if surface is None or q is None:
        return Thing(part.name, colour, *mesh, *pose)
    stress = _stress(part.flexible)
    far = np.array([max(_chunked(lambda u: np.abs(u).max(), surface.shape, q))])
    kept = _felt(surface.shape, stress, np.abs(q).max(axis=0)[None], far)
    chosen = surface.shape[:, kept], stress[:, kept], q[:, kept]
    return Thing(part.name, colour, *mesh, *pose, *chosen)


def _chunked(of: Callable[[Array], float], columns: Array, q: Array) -> Iterator[float]:
    """A number of the field (f, n) of columns (n, r), if any, some instants at a time."""
    for k in range(0, len(q) if columns.size else 0, FRAMES_AT_ONCE):
        yield float(of(q[k : k + FRAMES_AT_ONCE] @ columns.T))


def _limits(thing: Thing) -> dict[str, float]:
    """Largest displacement relative to the frame [m] and equivalent stress [Pa] of a motion."""
    far = _chunked(lambda u: np.linalg.norm(u.reshape(-1, 3), axis=1).max(), thing.shapes, thing.q)
    high = _chunked(lambda s: von_mises(s.reshape(-1, 6)).max(), thing.stress, thing.q)
    return {"displacement": max(far, default=0.0), "stress": max(high, default=0.0)}


def _scene(title: str, things: Sequence[Thing], size: int, look: dict[str, Any]) -> Scene:
    seen = np.concatenate([thing.corners() for thing in things])
    view, centre = _view(seen, look)
    bending = max(sum(thing.shapes.size > 0 for thing in things), 1)
    return {
        "schema": SCHEMA_NAME,
        "version": SCHEMA_VERSION,
        "title": title,
        "view": view,
        "size": float(np.ptp(seen, axis=0).max()),
        "magnify": look.get("magnify", 1.0),
        "bodies": [_encoded(thing, centre, size // bending) for thing in things],
        "modes": [],
    }


def _view(seen: Array, look: dict[str, Any]) -> tuple[Scene, Array]:
    """The eye, and the middle of what it sees; upright is an axis, unless something says more."""
    given = {key: look.get(key) for key in ("view", "up")}
    view, up = (None if x is None else finite(key, x, (3,)) for key, x in given.items())
    gravity = np.asarray(look.get("gravity", (0, 0, 0)), dtype=float)
    if up is None and gravity.any():
        up = -gravity
        toward = aimed(seen, 1000, view=view).toward
        if np.linalg.norm(np.cross(toward, up)) < 0.05 * np.linalg.norm(up):  # seen from above
            up = None
    camera = aimed(seen, 1000, view=view, up=up, heights=(0.02, 50.0))
    k = np.argmax(np.abs(camera.up))
    upright = np.eye(3)[k] * np.sign(camera.up[k]) if up is None else up / np.linalg.norm(up)
    radius = float(np.linalg.norm(seen - camera.focus, axis=1).max()) or 1.0
    wide = camera.height * camera.size[0] / camera.size[1]
    found = {"toward": camera.toward.tolist(), "up": upright.tolist(), "radius": radius}
    return found | {"tall": camera.height, "wide": wide}, camera.focus


def _encoded(thing: Thing, centre: Array, size: int) -> Scene:
    """A body as numbers for the page, its surface as coarse as its share of the bytes asks."""
    r = thing.shapes.shape[1]
    per_point = 2 * 3 * r * (3 if thing.stress.size else 1)
    n_max = int(np.clip(size // max(per_point, 1), MIN_POINTS, MAX_POINTS))
    kept, triangles = coarsened(thing.points, thing.triangles, n_max)
    X = thing.points[kept]

    def columns(A: Array, width: int) -> list[dict[str, object]]:
        rows = (width * kept[:, None] + np.arange(width)).ravel()
        return [quantised_column(column) for column in A[rows].T] if A.size else []

    return {
        "name": thing.name,
        "colour": thing.colour,
        "points": quantised_points(X),
        "triangles": corners(triangles, len(X)),
        "edges": corners(sharp_edges(X, triangles), len(X)),
        "shapes": columns(thing.shapes, 3),
        "stresses": columns(thing.stress, 6),
        "position": array(thing.position - centre, "float32"),
        "orientation": array(thing.orientation, "float32"),
        "q": array(thing.q if r else np.zeros(0), "float32"),
    }


def write_scene(scene: Scene, path: Path) -> None:
    """Write the scene of a motion."""
    write_whole(path, json.dumps(scene, separators=(",", ":")).encode())


def read_scene(path: Path) -> Scene:
    """The scene of a motion, looked at before a browser gets it."""
    text = check_readable(path, MAX_BYTES).read_bytes()
    with damaged("this is no scene of a run", path, "rom simulate writes it anew.", WRONG_JSON):
        scene: Scene = json.loads(text)
        known = scene["schema"] == SCHEMA_NAME and scene["version"][0] == SCHEMA_VERSION[0]
        need(known, f"version {scene['version']} is not known")
        _check(scene)
        return scene


def _finite(values: npt.ArrayLike) -> None:
    need(np.isfinite(np.asarray(values, dtype=float)).all(), "a number is not finite")


def _check(scene: Scene) -> None:
    for key, kind in KEYS.items():
        right = isinstance(scene[key], kind | int if kind is float else kind)
        need(right, f"{key} is {type(scene[key]).__name__}")
    need(scene["bodies"] and not scene["modes"], "there are no bodies that move")
    numbers = [scene[key] for key in ("size", "magnify", "start")]
    numbers += [scene["limits"][key] for key in ("displacement", "stress")]
    for key, n in VIEW_KEYS.items():
        values = scene["view"][key] if n else [scene["view"][key]]
        need(len(values) == (n or 1), f"{key} has {len(values)} numbers")
        numbers += values
    _finite(numbers)
    f = len(_numbers(scene["times"]))
    need(f >= 2, "the motion has fewer than two instants")
    for body in scene["bodies"]:
        _check_body(body, f)


def _check_body(body: Scene, f: int) -> None:
    name, points = body["name"], body["points"]
    named = isinstance(name, str) and isinstance(body["colour"], str)
    need(named, "a body has no name or colour")
    s, r = len(_numbers(points["values"])) // 3, len(body["shapes"])
    wanted = {"position": 3 * f, "orientation": 4 * f, "q": r * f}
    columns = [(3 * s, one) for one in body["shapes"]] + [(6 * s, one) for one in body["stresses"]]
    fit = all(len(_numbers(one["values"])) == n for n, one in columns)
    fit = fit and all(len(_numbers(body[key])) == n for key, n in wanted.items())
    fit = fit and len(body["stresses"]) in (0, r) and len(points["centre"]) == 3
    need(fit, f"arrays of {name!r} do not fit each other")
    _finite([*points["centre"], points["step"], *(one["scale"] for _, one in columns)])
    for key, n in {"triangles": 3, "edges": 2}.items():
        cells = _numbers(body[key])
        there = cells.size % n == 0 and cells.max(initial=0) < max(s, 1)
        need(there, f"{key} of {name!r} name points that are not there")


def _numbers(array: dict[str, str]) -> Array:
    values = np.frombuffer(b64decode(array["data"], validate=True), TYPES[array["type"]])
    _finite(values)
    return values
