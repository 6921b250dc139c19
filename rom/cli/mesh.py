"""Make or read a mesh, check it, and say what it holds."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.cli.answer import Answer, table
from rom.cli.options import add_geometry, assignment, reading, unique, vector
from rom.errors import ConfigError

if TYPE_CHECKING:
    from rom.fe.solid import SolidMesh

SUMMARY = "make or read a mesh, check it, show its regions and interfaces"
EXAMPLES = """\
  rom mesh meshes/connecting_rod.geo -p lc=4e-3
  rom mesh part.msh --scale 1e-3 --save part.vtu
  rom mesh part.step -p lc=0.002 --face pin=0,0,0.01
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
    parser.add_argument("--save", metavar="FILE.vtu", type=Path, help="write it for ParaView")


def run(args: argparse.Namespace) -> Answer:
    """Read, check, describe."""
    from rom.fe.mesh import read_mesh
    from rom.fe.summary import summary

    if args.save:
        _check_save(args.save)
    faces = unique([(name, _point(at)) for name, at in args.face], "--face")
    mesh = read_mesh(args.file, faces=faces, **reading(args))
    data = summary(mesh)
    if not args.save:
        return Answer(data, _text(data))
    data["saved"] = str(args.save)
    return Answer(data, _text(data), write=lambda: _save(mesh, args.save))


def _point(text: str) -> tuple[float, float, float]:
    try:
        return vector(text)
    except argparse.ArgumentTypeError as error:
        raise ConfigError(f"--face: {error}.") from None


def _check_save(path: Path) -> None:
    from rom.io.files import check_writable

    if path.suffix.lower() != ".vtu":
        raise ConfigError(f"--save {path}: a mesh is written as .vtu only.")
    check_writable(path)


def _save(mesh: "SolidMesh", path: Path) -> None:
    from rom.fe.summary import vtk_cells
    from rom.io.files import write_whole
    from rom.io.vtu import grid

    text = grid(mesh.points, *vtk_cells(mesh), at_cells={"region": mesh.regions})
    write_whole(path, lambda file: file.write(text.encode()))


def _text(data: dict[str, Any]) -> str:
    quality = ", ".join(f"{name} {value:.3g}" for name, value in data["quality"].items())
    regions = [(name, str(r["cells"]), f"{r['volume']:.6g}") for name, r in data["regions"].items()]
    faces = [(name, str(f["facets"]), str(f["nodes"])) for name, f in data["interfaces"].items()]
    box = " x ".join(f"{high - low:.4g}" for low, high in data["box"])
    parts = [
        f"{data['file']}: {data['cells']} cells {data['cell_type']}, {data['nodes']} nodes",
        f"size {box} m, volume {data['volume']:.6g} m^3",
        f"quality: {quality}",
    ]
    if regions:
        parts += ["", table(("region", "cells", "volume [m^3]"), regions)]
    parts += ["", table(("interface", "facets", "nodes"), faces) if faces else "no interface"]
    return "\n".join(parts)
