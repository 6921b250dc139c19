"""Draw the first elastic modes of a body, on its deformed surface."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from rom.cli.answer import Answer
from rom.cli.options import count

if TYPE_CHECKING:
    from rom.body.flexible import FlexibleBody

SUMMARY = "draw the mode shapes of a body"
EXAMPLES = """\
  rom view rod.rom.npz -o modes.png
  rom view rod.rom.npz -n 4 -o modes.png
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="body file, e.g. rod.rom.npz")
    parser.add_argument("-n", "--number", type=count, default=6, help="number of modes (default 6)")
    parser.add_argument("-o", "--output", type=Path, required=True, help="picture, .png")


def run(args: argparse.Namespace) -> Answer:
    """Load; the picture is drawn at the end."""
    from rom.errors import ConfigError
    from rom.io.files import check_writable
    from rom.io.native import load

    if args.output.suffix.lower() != ".png":
        raise ConfigError(f"{args.output}: a picture is written as .png only.")
    check_writable(args.output)
    body = load(args.file)
    data = {"file": str(args.file), "output": str(args.output)}
    text = f"{args.output}: modes of body {body.name}"
    return Answer(data, text, lambda: _draw(body, args.output, args.number))


def _draw(body: "FlexibleBody", path: Path, n: int) -> None:
    from rom.view import mode_shapes

    mode_shapes(body, path, n=n)
