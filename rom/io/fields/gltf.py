"""Moving bodies as glTF 2.0 binary (``.glb``), which browsers, slides and Blender play.

A body is a node that moves; its elastic coordinates are the weights of morph targets, one per
shape, so that the size of a file hardly depends on the number of instants.

Source:
    Khronos Group, glTF 2.0 Specification (ISO/IEC 12113:2022), sections 3.6, 3.7, 3.11 and 4.
"""

import json
import struct
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rom import rotation
from rom.io.files import write_whole
from rom.model import Array, Index

FLOAT_TYPE, UNSIGNED_TYPE = 5126, 5125  # componentType
VERTICES_TARGET, INDICES_TARGET = 34962, 34963  # target of a bufferView
KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
Entry = dict[str, object]  # of the JSON
SHAPE_RTOL = 1e-6  # of the largest displacement: shapes below are left out


@dataclass(frozen=True, slots=True)
class MovingMesh:
    """A body in a film.

    Attributes:
        name: name of the body.
        points: (n, 3) undeformed, body frame [m].
        triangles: (t, 3) corners, seen from outside counter-clockwise.
        origin: (f, 3) origin of its frame [m].
        orientation: (f, 4) quaternion of its frame, scalar first [1].
        shapes: (3 n, r) displacement per unit of each elastic coordinate [m].
        q: (f, r) elastic coordinates, in units of the shapes.
        colour: (3,) red, green, blue from 0 to 1 [1].
    """

    name: str
    points: Array
    triangles: Index
    origin: Array
    orientation: Array
    shapes: Array
    q: Array
    colour: tuple[float, float, float] = (0.55, 0.6, 0.66)


@dataclass(slots=True)
class _Document:
    """A file as it grows: its JSON and its one buffer."""

    lists: dict[str, list[Entry]] = field(default_factory=dict)
    data: bytearray = field(default_factory=bytearray)

    def put(self, kind: str, entry: Entry) -> int:
        self.lists.setdefault(kind, []).append(entry)
        return len(self.lists[kind]) - 1

    def accessor(self, values: Array | Index, *, target: int = 0, bounds: bool = False) -> int:
        """Add an array (m,) or (m, c), whole numbers as those without sign."""
        whole = values.dtype.kind == "i"
        A = np.ascontiguousarray(values, dtype="<u4" if whole else "<f4")
        view: Entry = {"buffer": 0, "byteOffset": len(self.data), "byteLength": A.nbytes}
        self.data += A.tobytes()
        if target:
            view["target"] = target
        entry: Entry = {
            "bufferView": self.put("bufferViews", view),
            "componentType": UNSIGNED_TYPE if whole else FLOAT_TYPE,
            "count": len(A),
            "type": KINDS[A.shape[1] if A.ndim == 2 else 1],
        }
        if bounds:
            low, high = (np.atleast_1d(x).astype(float).tolist() for x in (A.min(0), A.max(0)))
            entry |= {"min": low, "max": high}
        return self.put("accessors", entry)


def write_glb(
    bodies: list[MovingMesh], times: Array, path: str | Path, *, up: Array, title: str
) -> Path:
    """Write a film.

    Args:
        bodies: what is seen.
        times: (f,) when each instant is shown, ascending from zero [s].
        path: file to write.
        up: (3,) upright direction of the world [1], which the format calls y.
        title: name of the scene.
    """
    document, samplers, channels = _Document(), list[Entry](), list[Entry]()
    children = list(range(1, 1 + len(bodies)))
    world: Entry = {"name": "world", "rotation": _scalar_last(upright(up)), "children": children}
    root = document.put("nodes", world)
    clock = document.accessor(times, bounds=True)
    for body in bodies:
        _add(document, body, clock, (samplers, channels))
    document.put("scenes", {"name": title, "nodes": [root]})
    document.put("animations", {"name": title, "samplers": samplers, "channels": channels})
    return write_whole(path, _packed(document))


def upright(up: Array) -> Array:
    """(4,) quaternion of the shortest rotation that takes a direction to y."""
    up = np.asarray(up, dtype=float) / np.linalg.norm(up)
    p = np.r_[1 + up[1], np.cross(up, [0.0, 1.0, 0.0])]
    if p[0] < 1e-12:  # upside down
        return np.array([0.0, 1.0, 0.0, 0.0])
    return p / np.linalg.norm(p)


def _add(
    document: _Document, body: MovingMesh, clock: int, motion: tuple[list[Entry], list[Entry]]
) -> None:
    shapes, weights = _targets(body)
    points = document.accessor(body.points, target=VERTICES_TARGET, bounds=True)
    indices = document.accessor(body.triangles.ravel(), target=INDICES_TARGET)
    primitive: Entry = {"attributes": {"POSITION": points}, "indices": indices}
    surface = {"baseColorFactor": [*body.colour, 1.0], "metallicFactor": 0.2}
    metal: Entry = {"pbrMetallicRoughness": surface | {"roughnessFactor": 0.6}, "doubleSided": True}
    primitive["material"] = document.put("materials", metal)
    mesh: Entry = {"name": body.name, "primitives": [primitive]}
    if shapes:
        primitive["targets"] = [
            {"POSITION": document.accessor(u, target=VERTICES_TARGET, bounds=True)} for u in shapes
        ]
        mesh["weights"] = weights[0].tolist()
    quaternion = _scalar_last(rotation.continuous(body.orientation))
    node: Entry = {"name": body.name, "mesh": document.put("meshes", mesh)}
    node |= {"translation": body.origin[0].tolist(), "rotation": quaternion[0]}
    number = document.put("nodes", node)
    tracks = {"translation": body.origin, "rotation": np.array(quaternion)}
    if shapes:
        tracks["weights"] = weights.ravel()
    samplers, channels = motion
    for kind, values in tracks.items():
        channels.append({"sampler": len(samplers), "target": {"node": number, "path": kind}})
        output = document.accessor(values)
        samplers.append({"input": clock, "output": output, "interpolation": "LINEAR"})


def _targets(body: MovingMesh) -> tuple[list[Array], Array]:
    """Displacements (n, 3) of the shapes that are seen, and weights (f, k) from -1 to 1."""
    reach = np.abs(body.q).max(axis=0, initial=0.0)
    moved = body.shapes * reach
    sizes = np.abs(moved).max(axis=0, initial=0.0)
    kept = np.flatnonzero(sizes > SHAPE_RTOL * sizes.max(initial=0.0))
    shapes = [moved[:, k].reshape(-1, 3) for k in kept]
    return shapes, body.q[:, kept] / np.where(reach[kept] > 0, reach[kept], 1.0)


def _scalar_last(p: Array) -> list[float]:
    return np.roll(p, -1, axis=-1).tolist()


def _packed(document: _Document) -> bytes:
    """The header and the two chunks, each filled up to a multiple of four bytes."""
    head = {"asset": {"version": "2.0", "generator": "fenicsx-rom"}, "scene": 0}
    whole = head | document.lists | {"buffers": [{"byteLength": len(document.data)}]}
    text = json.dumps(whole, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    data = bytes(document.data) + b"\0" * (-len(document.data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    chunks += struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
