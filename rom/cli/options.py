"""Options several verbs share, and the forms their values may take."""

import argparse
from collections.abc import Callable, Mapping
from math import inf
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from rom.arguments import NotNegative, Number, Positive, Quantity
from rom.errors import ConfigError
from rom.fe.mesh.picks import picks
from rom.material import SOLIDS
from rom.model import Material
from rom.names import check_once, is_whole
from rom.units import SYSTEMS, in_si

T = TypeVar("T")
Kind = Callable[[str], object]  # what reads the value of an option
Keywords = dict[str, Any]
BYTES_PER_GIGABYTE = 1e9


def numbers_of(kind: Quantity) -> Callable[[str], Any]:
    """What reads the value of an option: numbers with commas, of the shape and limits of a kind."""
    n = kind.shapes[0]
    wanted = f"{n[0] or 'only'} numbers with commas" if n else "a number"

    def read(text: str) -> object:
        try:
            x = np.array([_in_si(word, kind.unit) for word in (text.split(",") if n else [text])])
        except ValueError:
            x = np.array([np.nan])
        except ConfigError as error:  # argparse names the option
            raise argparse.ArgumentTypeError(str(error)) from None
        x = x if n else x[0]
        if not (np.isfinite(x).all() and kind.has_shape(x.shape)):
            hint = " (write a decimal point)" if "," in text and not n else ""
            raise argparse.ArgumentTypeError(f"{text!r} is not {wanted}{hint}")
        if kind.fault(x):
            raise argparse.ArgumentTypeError(f"{text} {kind.must}")
        return tuple(x.tolist()) if n else float(x)

    return read


def _in_si(word: str, unit: str) -> float:
    """A number in SI, or with a unit of its own where one is meant."""
    bare = unit == "1" or word[-1:].isdigit() or not word[:1].strip("+-.").isdigit()
    return float(word) if bare else in_si(word, unit)


PRESSURE, DENSITY = numbers_of(Number("Pa")), numbers_of(Number("kg/m^3"))
DURATION, ACCELERATION = numbers_of(Positive("s")), numbers_of(Number("m/s^2", (3,)))
number, positive, not_negative = map(numbers_of, (Number(), Positive(), NotNegative()))
vector = numbers_of(Number("1", (3,)))


def typed_number(option: str, text: str) -> float:
    """A finite number in the value of an option."""
    try:
        return float(number(text))
    except argparse.ArgumentTypeError as error:
        raise ConfigError(f"{option}: {error}; a number is needed.") from None


def limit(text: str) -> float:
    """A number from zero on, or inf."""
    return inf if text == "inf" else float(not_negative(text))


def count(text: str) -> int:
    """A whole number, zero or more."""
    if not is_whole(text):
        raise argparse.ArgumentTypeError(f"{text!r} is not a whole number")
    return int(text)


def names(text: str) -> tuple[str, ...]:
    """Names with commas."""
    return tuple(filter(None, (part.strip() for part in text.split(","))))


def require(needed: Mapping[str, object], hint: str = "") -> None:
    """Name at once all options that a verb needs and nobody gave."""
    if missing := [name for name, value in needed.items() if value is None or value == []]:
        raise ConfigError(f"the following arguments are required: {', '.join(missing)}.", hint=hint)


def assignment(text: str) -> tuple[str, str]:
    """NAME=VALUE."""
    name, equals, value = text.partition("=")
    if not (name and equals and value):
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=VALUE")
    return name, value


def number_or_text(pair: tuple[str, str]) -> tuple[str, float | str]:
    """The value of an assignment as a number where it is one."""
    name, value = pair
    try:
        return name, float(value)
    except ValueError:
        return name, value


def unique(pairs: list[tuple[str, T]], option: str) -> dict[str, T]:
    """A dictionary of assignments."""
    check_once([name for name, _ in pairs], option)
    return dict(pairs)


def option(
    to: argparse._ActionsContainer, words: str, about: str, kind: Kind | None = None, **more: Any
) -> None:
    """Add an option to a parser or group, by its flags and, if need be, what stands for the value.

    One without a kind is a flag; assignments may be repeated, names be missing.
    """
    flags = [word for word in words.split() if word.startswith("-")]
    shown = [word for word in words.split() if word not in flags]
    how: Keywords = {"action": "store_true"} if kind is None else {"type": kind}
    how |= NOT_GIVEN.get(kind, {}) | ({"metavar": shown[0]} if shown else {}) | more
    to.add_argument(*flags, help=about, **how)


NOT_GIVEN: dict[Kind | None, Keywords] = {
    assignment: {"action": "append", "default": []},
    names: {"default": ()},
}


def add_geometry(parser: argparse.ArgumentParser) -> None:
    """The file and how to read it."""
    add_file(parser)
    about = (
        "name a face of a .step file: its number, as 12; a point X,Y,Z on it [m]; radius:R [m] for "
        "all cylinders of that radius; normal:X,Y,Z for the plane that looks there; several as "
        "3+4; may be repeated"
    )
    option(parser, "--face NAME=FACE", about, assignment)
    about = "factor on coordinates; 1e-3 for mm (default 1)"
    option(parser, "--scale", about, positive, default=1.0)
    about = (
        "degree of the cells' edges: 1 straight, 2 curved (default: 2 where the geometry is curved "
        "and --degree is not 1)"
    )
    option(parser, "--order", about, count, choices=(1, 2))
    add_meshing(parser)


def add_file(parser: argparse.ArgumentParser) -> None:
    """The file and its parameters."""
    parser.add_argument("file", type=Path, help=".geo .py .step .msh .unv .med .inp .bdf .cdb")
    about = "parameter of the geometry, e.g. lc=4e-3; may be repeated"
    option(parser, "-p --parameter NAME=VALUE", about, assignment)
    option(parser, "--unite", "connect the solids of a .step file where they touch")
    about = "of a deck and its materials, a mesh or matrices, in place of --scale (default SI)"
    option(parser, "--units", about, str, default="SI", choices=tuple(SYSTEMS))


def add_meshing(parser: argparse.ArgumentParser) -> None:
    """What a geometry, which is a program, may do and take."""
    group = parser.add_argument_group(
        "geometries are programs",
        "A .geo or .step is run in a process of its own, which can neither start others nor write "
        "files; a .geo that says it would is refused. A .py can do what you can.",
    )
    option(group, "--trust", "run .py files; read them first")
    option(group, "--time-limit SECONDS", "of meshing (default 1800, 0 for none)", limit)
    about = "of meshing (default 80 %% of the machine's, 0 for none)"
    option(group, "--memory-limit GIGABYTES", about, limit)


class Named(argparse.Action):
    """The numbers of a solid by its name, in place of those given before."""

    def __call__(self, _: object, space: argparse.Namespace, name: Any, __: object = None) -> None:
        """Set them."""
        vars(space).update(zip(("E", "nu", "rho"), SOLIDS[name], strict=True))


def add_solid(parser: argparse.ArgumentParser, usual: str | None = None) -> None:
    """Numbers of an elastic solid, one by one or by a name, if need be a usual one."""
    about = "E, nu and rho of it" + (f" (default {usual}, or as a deck says)" if usual else "")
    option(parser, "--material", about, str, choices=sorted(SOLIDS), action=Named)
    option(parser, "--E", "Young's modulus [Pa], or as 210GPa", PRESSURE)
    option(parser, "--nu", "Poisson's ratio", number)
    option(parser, "--rho", "density [kg/m^3], or as 7.85g/cm^3", DENSITY)


def add_interfaces(parser: argparse.ArgumentParser) -> None:
    """Interfaces by name and kind."""
    about = (
        "interface and its kind: full, rbe2 (stiff), rbe3 (average), polynomial:ORDER (polynomial "
        "alone: chosen with --tol) or fourier:HARMONICS,ORDER; may be repeated"
    )
    option(parser, "-i --interface NAME=KIND", about, assignment)


def reading(args: argparse.Namespace) -> Keywords:
    """Keyword arguments of `rom.fe.mesh.read.read_mesh`."""
    pairs = [number_or_text(pair) for pair in args.parameter]
    return {
        "parameters": unique([*pairs, *[("unite", 1.0)] * args.unite], "-p"),
        "faces": faces(args.face),
        "scale": args.scale,
        "units": args.units,
        "order": args.order,
        **meshing(args),
    }


def faces(pairs: list[tuple[str, str]]) -> dict[str, str]:
    """What picks each face, by name."""
    found = unique(pairs, "--face")
    for text in found.values():
        face(text, "--face")
    return found


def face(text: str, option: str) -> str:
    """The text, if it picks a face."""
    try:
        picks(text)
    except ConfigError as error:
        raise ConfigError(f"{option}: {error.message}", hint=error.hint) from None
    return text


def meshing(args: argparse.Namespace) -> Keywords:
    """Those of them that `add_meshing` asks for."""
    memory = None if args.memory_limit is None else BYTES_PER_GIGABYTE * args.memory_limit
    return {"trust": args.trust, "time_limit": args.time_limit, "memory_limit": memory}


def solid_options(args: argparse.Namespace) -> dict[str, float | None]:
    """What a geometry needs, by option; matrices do not, nor a deck where nothing is given."""
    from rom.fe.mesh.read import is_deck

    found = {f"--{name}": getattr(args, name) for name in ("E", "nu", "rho")}
    needless = is_deck(args.file) and set(found.values()) == {None}
    return {} if needless or getattr(args, "mass", None) is not None else found


def material(args: argparse.Namespace, usual: str = "") -> Material | None:
    """The material the options ask for, if need be of a usual one; None for that of a deck."""
    given = args.E, args.nu, args.rho
    pairs = zip(given, SOLIDS.get(usual, given), strict=True)
    return Material(*(y if x is None else x for x, y in pairs)) if solid_options(args) else None


def verb_parsers(parser: argparse.ArgumentParser) -> dict[str, argparse.ArgumentParser]:
    """{verb: its parser} of the whole grammar."""
    (verbs,) = (a for a in parser._actions if isinstance(a, argparse._SubParsersAction))
    return dict(verbs.choices)


def options_of(parser: argparse.ArgumentParser) -> list[str]:
    """Long options."""
    return sorted(s for s in parser._option_string_actions if s.startswith("--"))
