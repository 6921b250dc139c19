"""The scene of a run as a file beside its table, so that a report needs neither body nor solver."""

import base64
import binascii
import json
from pathlib import Path
from typing import Any

import numpy as np

from rom.errors import FileFormatError
from rom.io.files import check_readable, write_whole
from rom.report.coarse import TYPES
from rom.report.scene import SCHEMA_NAME, SCHEMA_VERSION

MAX_BYTES = 50_000_000  # of a file that is still read
KEYS = {
    "title": str, "view": dict, "size": float, "magnify": float, "start": float, "limits": dict,
    "bodies": list, "modes": list,
}  # fmt: skip
VIEW_KEYS = {"toward": 3, "up": 3, "radius": 0, "tall": 0, "wide": 0}  # and how many numbers


def write_scene(scene: dict[str, Any], path: Path) -> None:
    """Write the scene of a motion."""
    text = json.dumps(scene, separators=(",", ":"))
    write_whole(path, lambda file: file.write(text.encode()))


def read_scene(path: Path) -> dict[str, Any]:
    """The scene of a motion, looked at before a browser gets it."""
    text = check_readable(path, MAX_BYTES).read_bytes()
    try:
        scene = json.loads(text)
        if scene["schema"] != SCHEMA_NAME or scene["version"][0] != SCHEMA_VERSION[0]:
            raise FileFormatError(f"version {scene['version']} is not known.", where=str(path))
        _check(scene)
    except (ValueError, KeyError, TypeError, IndexError, AttributeError, RecursionError) as error:
        raise FileFormatError(
            f"is no scene of a run: {error!s:.200}.", where=str(path),
            hint="rom simulate writes it anew.",
        ) from None  # fmt: skip
    known: dict[str, Any] = scene
    return known


def _check(scene: dict[str, Any]) -> None:
    for key, kind in KEYS.items():
        if not isinstance(scene[key], kind | int if kind is float else kind):
            raise ValueError(f"{key} is {type(scene[key]).__name__}")
    if scene["modes"] or not scene["bodies"]:
        raise ValueError("there are no bodies that move")
    numbers = [scene[key] for key in ("size", "magnify", "start")]
    numbers += [scene["limits"][key] for key in ("displacement", "stress")]
    for key, n in VIEW_KEYS.items():
        values = scene["view"][key] if n else [scene["view"][key]]
        if n and len(values) != n:
            raise ValueError(f"{key} has {len(values)} numbers")
        numbers += values
    if not np.isfinite(np.array(numbers, dtype=float)).all():
        raise ValueError("a number is not finite")
    f = len(_numbers(scene["times"]))
    if f < 2:
        raise ValueError("the motion has fewer than two instants")
    for body in scene["bodies"]:
        _check_body(body, f)


def _check_body(body: dict[str, Any], f: int) -> None:
    """Whether the arrays of a body fit each other, and the number of instants."""
    if not isinstance(body["name"], str) or not isinstance(body["colour"], str):
        raise ValueError("a body has no name or colour")
    s, r = len(_numbers(body["points"]["values"])) // 3, len(body["shapes"])
    wanted = {"position": 3 * f, "orientation": 4 * f, "q": r * f}
    found = {key: len(_numbers(body[key])) for key in wanted}
    columns = [(3 * s, one) for one in body["shapes"]] + [(6 * s, one) for one in body["stresses"]]
    fit = all(len(_numbers(one["values"])) == n for n, one in columns)
    if found != wanted or not fit or len(body["stresses"]) not in (0, r):
        raise ValueError(f"arrays of {body['name']!r} do not fit each other")
    scales = [*body["points"]["centre"], body["points"]["step"], *(o["scale"] for _, o in columns)]
    if len(body["points"]["centre"]) != 3 or not np.isfinite(np.array(scales, dtype=float)).all():
        raise ValueError(f"a number of {body['name']!r} is not finite")
    for key in ("triangles", "edges"):
        cells = _numbers(body[key])
        if cells.size % (3 if key == "triangles" else 2) or cells.max(initial=0) >= max(s, 1):
            raise ValueError(f"{key} of {body['name']!r} name points that are not there")


def _numbers(array: dict[str, str]) -> Any:
    """An array of a scene, finite."""
    try:
        data = base64.b64decode(array["data"], validate=True)
    except binascii.Error as error:
        raise ValueError(f"an array is cut: {error}") from None
    values = np.frombuffer(data, dtype=TYPES[array["type"]])
    if not np.isfinite(values).all():
        raise ValueError("a number is not finite")
    return values
