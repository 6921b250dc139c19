"""The scene of a run as a file beside its table, so that a report needs neither body nor solver."""

import json
from base64 import b64decode
from pathlib import Path

import numpy as np
import numpy.typing as npt

from rom.io.files import WRONG_JSON, check_readable, damaged, need, write_whole
from rom.model import Array
from rom.report.coarse import TYPES
from rom.report.scene import SCHEMA_NAME, SCHEMA_VERSION, Scene

MAX_BYTES = 50_000_000  # of a file that is still read
KEYS: dict[str, type] = dict.fromkeys(("size", "magnify", "start"), float)
KEYS |= {"view": dict, "limits": dict, "title": str, "bodies": list, "modes": list}
VIEW_KEYS = {"toward": 3, "up": 3, "radius": 0, "tall": 0, "wide": 0}  # and how many numbers


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
