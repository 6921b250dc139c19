"""Make or read a mesh, check it, and say what it holds."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.cli.answer import Answer, table
from rom.cli.described import component, described
from rom.cli.options import (
    add_geometry,
    add_solid,
    assignment,
    material,
    reading,
    unique,
    vector,
)
from rom.cli.output import add_force, checked
from rom.errors import ConfigError

if TYPE_CHECKING:
    from rom.fe.mesh.solid import SolidMesh
    from rom.model import Material

DECK_SUFFIX = ".inp"
SUMMARY = "make or read a mesh, check it, show its regions and interfaces"
EXAMPLES = """\
  rom mesh meshes/connecting_rod.geo -p lc=4e-3
  rom mesh meshes/connecting_rod.toml      # its geometry
  rom mesh part.msh --scale 1e-3 --save part.vtu
  rom mesh part.step --faces
  rom mesh part.step -p lc=0.002 --face pin=0,0,0.01
  rom mesh meshes/beam.geo --save beam.inp --E 210e9 --nu 0.3 --rho 7850   # then: ccx beam
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    add_geometry(parser)
    parser.add_argument(
        "--face",
        metavar="NAME=X,Y,Z",
        type=assignment,
        action="append",
        default=[],
        help="name the surface of a .step file next to a point [m]; may be repeated",
    )
    parser.add_argument(
        "--faces", action="store_true", help="list every face of a .step file, by its number"
    )
    parser.add_argument(
        "--save",
        metavar="FILE",
        type=Path,
        help=".vtu for ParaView; .inp for CalculiX and Abaqus, and with --E, --nu, --rho CalculiX "
        "runs it and leaves matrices for rom modes and rom reduce",
    )
    add_solid(parser)
    add_force(parser)


def run(args: argparse.Namespace) -> Answer:
    """Read, check, describe."""
    from rom.fe.mesh.read import read_mesh
    from rom.fe.mesh.summary import summary

    if described(args):
        part = component(args, "save", "faces")
        file, how = part.mesh
        deck = args.save is not None and args.save.suffix.lower() == DECK_SUFFIX
        solid = part.material() if deck else None
    else:
        solid, file, how = _solid(args), args.file, reading(args)
        how["faces"] = unique([(name, _point(at)) for name, at in args.face], "--face")
    if args.save:
        _check_save(args, file)
    if args.faces:
        how["faces"] = how["faces"] | {"face": "every"}
    mesh = read_mesh(file, **how)
    data = summary(mesh)
    if not args.save:
        return Answer(data, _text(data))
    data["saved"] = str(args.save)
    return Answer(data, _text(data), write=lambda: _save(mesh, args.save, solid))


def _point(text: str) -> tuple[float, float, float]:
    try:
        return vector(text)
    except argparse.ArgumentTypeError as error:
        raise ConfigError(f"--face: {error}.") from None


def _check_save(args: argparse.Namespace, geometry: Path) -> None:
    path = args.save
    if path.suffix.lower() not in (".vtu", DECK_SUFFIX):
        raise ConfigError(f"--save {path}: a mesh is written as .vtu or .inp only.")
    kind = "deck" if path.suffix.lower() == DECK_SUFFIX else "vtu"
    checked(args, path, kind, inputs=[geometry])


def _solid(args: argparse.Namespace) -> "Material | None":
    """The material of a deck; None for the mesh alone."""
    given = [f"--{name}" for name in ("E", "nu", "rho") if getattr(args, name) is not None]
    if not given:
        return None
    if args.save is None or args.save.suffix.lower() != DECK_SUFFIX:
        raise ConfigError(f"{given[0]} goes with --save FILE.inp.")
    if len(given) < 3:
        raise ConfigError(f"a material needs --E, --nu and --rho, got {', '.join(given)}.")
    return material(args)


def _save(mesh: "SolidMesh", path: Path, solid: "Material | None") -> None:
    from rom.fe.mesh.input_deck import input_deck
    from rom.fe.mesh.summary import vtk_cells
    from rom.io.fields.vtu import grid
    from rom.io.files import write_whole

    if path.suffix.lower() == DECK_SUFFIX:
        text = input_deck(mesh, material=solid, step="matrices")
    else:
        text = grid(mesh.points, *vtk_cells(mesh), at_cells={"region": mesh.regions})
    write_whole(path, lambda file: file.write(text.encode()))


def _text(data: dict[str, Any]) -> str:
    quality = ", ".join(f"{name} {value:.3g}" for name, value in data["quality"].items())
    regions = [(name, str(r["cells"]), f"{r['volume']:.6g}") for name, r in data["regions"].items()]
    faces = [
        (name, str(f["facets"]), str(f["nodes"]), ", ".join(f"{x:.4g}" for x in f["middle"]))
        for name, f in data["interfaces"].items()
    ]
    box = " x ".join(f"{high - low:.4g}" for low, high in data["box"])
    parts = [
        f"{data['file']}: {data['cells']} cells {data['cell_type']}, {data['nodes']} nodes",
        f"size {box} m, volume {data['volume']:.6g} m^3",
        f"quality: {quality}",
    ]
    if regions:
        parts += ["", table(("region", "cells", "volume [m^3]"), regions)]
    header = ("interface", "facets", "nodes", "middle [m]")
    parts += ["", table(header, faces) if faces else "no interface"]
    return "\n".join(parts)
