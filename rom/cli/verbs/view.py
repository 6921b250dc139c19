"""Look at a body, a component or a mechanism: in a window where there is a display, else a picture.

A body moves in its modes, a component shows its mesh, a mechanism its bodies as they are placed.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import rom
from rom.cli.answer import Answer
from rom.cli.described import component, described, mechanism
from rom.cli.options import add_meshing, count, names, option
from rom.cli.output import add_force, checked
from rom.names import check_ending

SUMMARY = "look at a body, a component or a mechanism"
EXAMPLES = """\
  rom view rod.rom.npz                  # a window to turn it around in
  rom view rod.rom.npz -o modes.png
  rom view rod.rom.npz -n 4 --fixed pin_a -o modes.png
  rom view demos/slider_crank.toml -o start.png
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="body file, e.g. rod.rom.npz, or .toml file")
    option(parser, "-n --number", "number of modes (default 6)", count, default=6)
    option(parser, "--fixed NAME,...", "interfaces held, wholly or as NAME:yz, for modes", names)
    option(parser, "-o --output", "picture, .png, and no window", Path)
    add_meshing(parser)
    add_force(parser)


def run(args: argparse.Namespace) -> Answer:
    """Load; the picture is drawn, or the window opened, at the end."""
    path = args.output or Path(f"{args.file.name.partition('.')[0]}.png")
    check_ending(path, "a picture", ".png")
    from rom.view.scenes.window import has_display, show

    window = args.output is None and has_display()
    if not window:
        checked(args, path)
    what, draw, scenes = _subject(args)
    data = {"file": str(args.file), "output": None if window else str(path)}
    if window:
        return Answer(data, f"{what}, in a window", lambda: show(scenes()))
    why = "" if args.output else "; there is no display for a window"
    return Answer(data, f"{path}: {what}{why}", lambda: draw(path))


def _subject(
    args: argparse.Namespace,
) -> "tuple[str, Callable[[Path], object], Callable[[], list[rom.view.Scene]]]":
    """What it is, how it is drawn, and how it is shown in a window."""
    if not described(args):
        from rom.io.native import load
        from rom.view.scenes.window import mode_scenes

        body, how = load(args.file), {"n": args.number, "fixed": args.fixed}
        body.check_support(args.fixed)
        return (
            f"modes of body {body.name}",
            lambda path: rom.view.mode_shapes(body, path, **how),
            lambda: mode_scenes(body, **how),
        )
    from rom.config.document import read_document
    from rom.report.run import look_of
    from rom.view.scenes.film import start_scene

    if "bodies" in read_document(args.file).data:
        file = mechanism(args)
        made, look = file.mechanism(), look_of(file)
        return (
            f"mechanism {file.name} as it is placed",
            lambda path: rom.view.start(made, path, title=f"Mechanism {file.name}", **look),
            lambda: [start_scene(made, file.name, **look)],
        )
    part = component(args)
    model = part.model()
    return (
        f"mesh of component {part.name}",
        lambda path: rom.view.mesh(model, path, title=f"Component {part.name}"),
        lambda: [rom.view.Scene(part.name, rom.view.meshed(model))],
    )
