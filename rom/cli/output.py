"""Where a verb may write: over its own earlier files, over others only with --force."""

import argparse
import os
import shlex
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TypeVar

from rom.cli.options import option
from rom.process.launcher import ranks

T = TypeVar("T")
KIND_OF_ENDING = {"hdf5": "h5"}  # endings that are not the name of their kind
OUTPUT_OPTIONS = ("output", "save")  # options that name what is written
OTHER_OPTIONS = ("argv", "given", "run", "claims", "verb")


def on_first_rank(look: Callable[[], T]) -> T:
    """What one rank finds out for all of them, or its error on all of them."""
    if ranks()[1] == 1:
        return look()
    from rom.fe.parallel import on_first_rank as on_first

    return on_first(look)


def add_force(parser: argparse.ArgumentParser) -> None:
    """The option of every verb that writes."""
    option(parser, "--force", "replace files that rom has not written itself")


def checked(
    args: argparse.Namespace, path: Path, kind: str = "", *, inputs: Iterable[Path] = ()
) -> Path:
    """The path, if the verb may and can write it; to be asked before the computation.

    One rank writes, and looks for all. Options and inputs name what is read. The kind is a key of
    `rom.io.ours.FILE_SIGNS`; that of the ending if not given.
    """
    from rom.io.ours import check_replaceable

    ending = path.suffix.lower().removeprefix(".")
    kind = kind or KIND_OF_ENDING.get(ending, ending)
    if kind == "mp4":
        from rom.view.canvas.films import encoder

        encoder()
    sources = [*inputs, *_inputs(args)]
    return on_first_rank(lambda: check_replaceable(path, kind, inputs=sources, force=args.force))


def usual(args: argparse.Namespace, ending: str) -> Path:
    """What ``-o`` says, else a name beside where the user is, made from that of the file."""
    return args.output or Path(args.file.resolve().name.partition(".")[0] + ending)


def typed_command(args: argparse.Namespace) -> str:
    """What was typed, as a shell takes it."""
    return f"rom {shlex.join(args.argv)}"


def claim(args: argparse.Namespace) -> Path:
    """The folder of ``-o``, kept from other runs until the files of this one are written."""
    from rom.io.ours import claimed

    folder: Path = args.output
    on_first_rank(lambda: args.claims.enter_context(claimed(folder)))
    return folder


def files_in(values: object) -> Iterator[Path]:
    """The files that a description names, but for those it writes."""
    if isinstance(values, Path):
        yield values
    elif isinstance(values, dict):
        for key, value in values.items():
            if key not in OUTPUT_OPTIONS:
                yield from files_in(value)
    elif isinstance(values, list | tuple):
        for value in values:
            yield from files_in(value)


def _inputs(args: argparse.Namespace) -> Iterator[Path]:
    """Files named by options, also as FILE:MATRIX."""
    for name, value in vars(args).items():
        if name in (*OUTPUT_OPTIONS, *OTHER_OPTIONS):
            continue
        for text in (str(value), str(value).rpartition(":")[0]):
            if isinstance(value, str | Path) and "\0" not in text and os.path.exists(text):
                yield Path(text)
