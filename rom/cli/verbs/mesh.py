"""Make or read a mesh, check it, and say what it holds."""

import argparse
from collections.abc import Iterable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import rom
from rom.cli.answer import Answer, Data, table
from rom.cli.described import component, described
from rom.cli.options import add_geometry, add_solid, material, option, reading
from rom.cli.output import add_force, checked
from rom.names import check_ending

if TYPE_CHECKING:
    from rom.config.component import Solid
    from rom.fe.mesh.solid import SolidMesh

DECK_SUFFIX = ".inp"
CAD_RTOL = 1e-5  # of the size: error of middles of faces, which the CAD finds by integration
FACE_WORD = "face"  # name of a listed face, before its number
SUMMARY = "make or read a mesh, check it, show its regions and interfaces"
EXAMPLES = """\
  rom mesh meshes/connecting_rod.geo -p lc=4e-3
  rom mesh meshes/connecting_rod.toml      # its geometry
  rom mesh part.msh --scale 1e-3 --save part.vtu
  rom mesh part.step --faces --save faces.png        # the numbers of its faces
  rom mesh part.step -p lc=0.002 --face pin=0,0,0.01 --face bore=radius:0.006
  rom mesh meshes/beam.geo --save beam.inp --E 210e9 --nu 0.3 --rho 7850   # then: ccx beam
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    add_geometry(parser)
    about = "list every face of a .step file: number, kind, radius, axis or normal, area, middle"
    option(parser, "--faces", about)
    about = (
        ".png for a picture of the interfaces, with --faces of all faces and their numbers; .vtu "
        "for ParaView; .inp for CalculiX and Abaqus, and with --E, --nu, --rho CalculiX runs it "
        "and leaves matrices for rom modes and rom reduce"
    )
    option(parser, "--save FILE", about, Path)
    add_solid(parser)
    add_force(parser)


def run(args: argparse.Namespace) -> Answer:
    """Read, check, describe."""
    from rom.fe.mesh.picks import EVERY_FACE
    from rom.fe.mesh.read import read_mesh
    from rom.fe.mesh.summary import summary

    if described(args):
        part = component(args, "save", "faces")
        file, how = part.mesh
        deck = args.save is not None and args.save.suffix.lower() == DECK_SUFFIX
        solid = part.material() if deck else None
    else:
        solid, file, how = _solid(args), args.file, reading(args)
    if args.save:
        path = check_ending(args.save, "a mesh", ".png", ".vtu", DECK_SUFFIX)
        ending = path.suffix.lower()
        checked(args, path, "deck" if ending == DECK_SUFFIX else ending[1:], inputs=[file])
    if args.faces:
        if FACE_WORD in how["faces"]:
            raise rom.ConfigError(
                f"--faces lists the faces as {FACE_WORD} 1, {FACE_WORD} 2, ..., so none can be "
                f"called {FACE_WORD!r}.",
                hint="Give it another name, or leave --faces out.",
            )
        how["faces"] = how["faces"] | {FACE_WORD: EVERY_FACE}
    mesh = read_mesh(file, **how)
    data = summary(mesh)
    if not args.save:
        return Answer(data, _text(data))
    data["saved"] = str(args.save)
    return Answer(data, _text(data), write=lambda: _save(mesh, args.save, solid))


def _solid(args: argparse.Namespace) -> rom.Material | None:
    given = [f"--{name}" for name in ("E", "nu", "rho") if getattr(args, name) is not None]
    if not given:
        return None
    if args.save is None or args.save.suffix.lower() != DECK_SUFFIX:
        raise rom.ConfigError(f"{given[0]} needs --save FILE.inp.")
    if len(given) < 3:
        raise rom.ConfigError(f"a material needs --E, --nu and --rho, got {', '.join(given)}.")
    return material(args)


def _save(mesh: "SolidMesh", path: Path, solid: "Solid | dict[str, Solid] | None") -> None:
    from rom.fe.mesh.input_deck import input_deck
    from rom.fe.mesh.summary import vtk_cells
    from rom.io.fields.vtu import grid
    from rom.io.files import write_whole

    if path.suffix.lower() == ".png":
        _draw(mesh, path)
        return
    if path.suffix.lower() == DECK_SUFFIX:
        text = input_deck(mesh, material=solid, step="matrices")
    else:
        text = grid(mesh.points, *vtk_cells(mesh), at_cells={"region": mesh.regions})
    write_whole(path, lambda file: file.write(text.encode()))


def _draw(mesh: "SolidMesh", path: Path) -> None:
    from rom.fe.mesh.summary import surface_triangles
    from rom.view.scenes.faces import faces

    numbers = {_numbered(asdict(face)): str(face.number) for face in mesh.faces}
    patches = {numbers.get(k, k): t for k, t in surface_triangles(mesh).items()}
    faces(mesh.points, patches, path, title=Path(mesh.provenance["path"]).name)


def _text(data: Data) -> str:
    listed = data.get("faces", [])
    numbered = {_numbered(face) for face in listed}
    size = max(high - low for low, high in data["box"])
    quality = ", ".join(
        f"{name} {value}" if isinstance(value, int) else f"{name} {value:.3g}"
        for name, value in data["quality"].items()
    )
    regions = [(name, str(r["cells"]), f"{r['volume']:.6g}") for name, r in data["regions"].items()]
    faces = []
    for name, f in data["interfaces"].items():
        if name not in numbered:
            places = _words(f["middle"], size), _words(f.get("axis", ()))
            faces.append((name, str(f["facets"]), str(f["nodes"]), *places))
    box = " x ".join(f"{high - low:.4g}" for low, high in data["box"])
    parts = [
        f"{data['file']}: {data['cells']} cells {data['cell_type']}, {data['nodes']} nodes",
        f"size {box} m, volume {data['volume']:.6g} m^3",
        f"quality: {quality}",
    ]
    given = ", ".join(f"{name} = {x:.6g}" for name, x in data["parameters"].items())
    parts += [f"parameters: {given}"] if given else []
    parts += [f"tie {name}: {n} nodes of the deck" for name, n in data["ties"].items()]
    parts += [f"mass of {one['mass']:.6g} kg on {one['interface']}" for one in data["masses"]]
    parts += [f"spring {name}" for name in data["springs"]]
    if regions:
        parts += ["", table(("region", "cells", "volume [m^3]"), regions)]
    header = ("interface", "facets", "nodes", "middle [m]", "axis")
    if faces or not listed:
        parts += ["", table(header, faces) if faces else "no interface"]
    if listed:
        columns = ("face", "kind", "radius [m]", "area [m^2]", "middle [m]", "axis or normal", "")
        parts += ["", table(columns, [_row(face, size) for face in listed])]
    return "\n".join(parts)


def _row(face: Data, size: float) -> tuple[str, ...]:
    radius = "" if face["radius"] is None else f"{face['radius']:.6g}"
    direction = _words(face["axis"] or face["normal"] or ())
    name = "" if face["name"] == _numbered(face) else face["name"]
    number, area, middle = str(face["number"]), f"{face['area']:.4g}", _words(face["middle"], size)
    return number, face["kind"], radius, area, middle, direction, name


def _numbered(face: Data) -> str:
    return f"{FACE_WORD} {face['number']}"


def _words(x: Iterable[float], size: float = 1.0) -> str:
    """Numbers as they may be copied into --face; what the CAD integrates no closer is zero."""
    least = CAD_RTOL * size
    return ",".join(f"{value if abs(value) > least else 0.0:.4g}" for value in x)
