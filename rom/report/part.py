"""The page of a part that is open: its faces to click, and what is chosen for its first swing."""

import html
import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from rom.material import SOLIDS
from rom.model import Array, Index
from rom.names import ORIGIN_MARK
from rom.report.html import headed, page
from rom.report.scene import faces_scene
from rom.report.viewer import figure

SCRIPT = Path(__file__).with_name("part.js").read_text(encoding="utf-8")
USUAL = "steel"
CAPTION = (
    "Click a face to choose it, again to leave it out; drag to turn the part. The first one "
    "chosen, in red, is what the part hangs on; others, in yellow, become interfaces."
)
COLUMNS = "face", "what it is", "name", "hangs here", ""
Face = dict[str, object]


def part_page(
    points: Array, patches: Mapping[str, Index], faces: Mapping[str, Face], title: str
) -> str:
    """The page of a part, of points and patches as for `faces_scene`, and its `known_faces`."""
    scene = faces_scene(points, patches, title=title)
    known = {"faces": faces, "materials": {name: _shown(one) for name, one in SOLIDS.items()}}
    data = json.dumps(known).replace("<", "\\u003c")
    sections = {
        "The part": [figure(scene, [], CAPTION)],
        "What is chosen": [_form(), f"<script type='application/json' id='part'>{data}</script>"],
        "The swing": ["<pre id='progress' aria-live='polite'></pre><div id='result'></div>"],
    }
    return page(headed(sections, title), title, SCRIPT)


def known_faces(labels: Iterable[str], listed: Iterable[dict[str, Any]]) -> dict[str, Face]:
    """{label: what it is, its name, and whether that must stay} of faces of mesh and CAD."""
    found: dict[str, Face] = {name: {"about": "", "name": name, "fixed": True} for name in labels}
    for face in listed:
        radius = f", radius {1e3 * face['radius']:.5g} mm" if face["radius"] else ""
        about = f"{face['kind']}{radius}, {1e6 * face['area']:.4g} mm²"
        found[face["name"]] = {"about": about, "name": f"face{face['number']}", "fixed": False}
    return found


def _shown(numbers: tuple[float, float, float]) -> list[str]:
    """E in GPa, Poisson's ratio, density, as they stand in the form."""
    E, nu, rho = numbers
    return [f"{E / 1e9:g}", f"{nu:g}", f"{rho:g}"]


def _form() -> str:
    E, nu, rho = _shown(SOLIDS[USUAL])
    chosen = (f"<option{' selected' * (name == USUAL)}>{name}</option>" for name in SOLIDS)
    fields = (
        f"<label>{html.escape(words)} <input name='{name}' value='{value}' inputmode='decimal' "
        "size='8'></label>"
        for name, words, value in (
            ("E", "E [GPa]", E),
            ("nu", "Poisson's ratio", nu),
            ("rho", "Density [kg/m³]", rho),
            ("size", "Element size [mm], or none for the usual one", ""),
        )
    )
    head = "".join(f"<th>{html.escape(name)}</th>" for name in COLUMNS)
    return (
        f"<form id='choice' autocomplete='off'><table id='chosen'><thead><tr>{head}</tr></thead>"
        "<tbody></tbody></table><p id='none'>No face is chosen yet.</p><div class='controls'>"
        f"<label>Material <select name='material'>{''.join(chosen)}"
        "<option value=''>other</option></select></label>"
        f"{''.join(fields)}</div><div class='controls'>"
        "<button type='button' name='swing'>Mesh, reduce and swing</button>"
        "<button type='button' name='stop' hidden>Stop</button>"
        "<button type='button' name='save'>Save as a file</button></div></form>"
    )


def component_text(
    geometry: Mapping[str, str],
    parameters: Mapping[str, float | str],
    faces: Mapping[str, str],
    hinge: str,
    solid: Mapping[str, float],
) -> str:
    """The component file of what is chosen: faces by name, E [GPa], nu, rho [kg/m^3]."""
    tables = {
        "geometry": geometry,
        "geometry.parameters": parameters,
        "geometry.faces": {name: face for name, face in faces.items() if name != face},
        "material": {"E": f"{solid['E']:.12g} GPa", "nu": solid["nu"], "rho": solid["rho"]},
        "interfaces": dict.fromkeys(faces, "rbe2"),
        "reduction": {"reference": [hinge]},
        "damping": {"ratio": 0.01, "fixed": [hinge]},
    }
    found = [f"# A part as it was chosen, {ORIGIN_MARK}\n"]
    for title, values in tables.items():  # a text, number or list of texts of JSON is one of TOML
        lines = (f"{_key(name)} = {json.dumps(value)}\n" for name, value in values.items())
        found += [f"\n[{title}]\n", *lines] if values else []
    return "".join(found)


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name)
