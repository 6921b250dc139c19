"""Components and mechanisms described by files: what a command line says goes before the file."""

import argparse
from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

import rom
from rom.arguments import Quantity, Whole
from rom.cli.options import count, faces, meshing, names, number_or_text, numbers_of, option, unique
from rom.config.component_keys import TABLE
from rom.config.keys import Text
from rom.config.keys import words as some_words

if TYPE_CHECKING:
    from rom.config.component import Component
    from rom.config.mechanism import MechanismFile

TOML_SUFFIX = ".toml"
COMMON_OPTIONS = set("verb file run output force json quiet verbose strict debug version".split())
COMMON_OPTIONS |= set("resume parser trust time_limit memory_limit".split())  # no file may say them
Changes = dict[tuple[str, ...], Any]
SECTION_KEYS = {  # section: keys whose options are called as they are
    "material": "E nu rho",
    "geometry": "degree order solver",
    "reduction": "method modes f_max tol at characteristic gravity_shapes reference stiffening "
    "stress",
    "modes": "number fixed spring",
}
PLACES: dict[str, tuple[str, ...]] = {  # option: key
    "name": ("name",),
    "damping_ratio": ("damping", "ratio"),
    "damping_fixed": ("damping", "fixed"),
} | {key: (section, key) for section, keys in SECTION_KEYS.items() for key in keys.split()}
MOTION_KEYS: dict[str, tuple[str, ...]] = {
    "gravity": ("gravity",),
    "t_end": ("simulation", "t_end"),
    "dt": ("simulation", "dt"),
    "film": ("output", "film"),
    "history": ("output", "history"),
}
VALUES: dict[object, Callable[[str], object]] = {Whole: count, some_words: names, Text: str}
REPLACED_KEYS = {  # an option takes the place of what contradicts it
    "modes": (("reduction", "f_max"), ("reduction", "tol")),
    "f_max": (("reduction", "modes"),),
    "tol": (("reduction", "modes"),),
    "damping_ratio": (("damping", "alpha"), ("damping", "beta")),
}


def keyed(to: argparse._ActionsContainer, *several: str) -> None:
    """Add options, each by its flags and what stands for its value, as keys of files are meant."""
    for words in several:
        place = PLACES[words.partition("--")[2].split()[0].replace("-", "_")]
        kind: Any = TABLE
        for name in place:
            key = next(key for key in kind.keys if key.name == name)
            kind = key.kind
        unit = getattr(kind, "unit", "1")
        about = key.about.rstrip(".").replace("`", "").replace("%", "%%")
        about = about[0].lower() + about[1:]
        about += f" [{unit}]" if unit != "1" else ""
        if key.default:
            default = key.default if isinstance(key.default, tuple) else (key.default,)
            about += f" (default {', '.join(map(str, default))})"
        how = {"choices": kind.choices} if getattr(kind, "choices", ()) else {}
        # what reads its value in SI; None for a flag, which has none
        by_kind = VALUES.get(kind) or VALUES.get(type(kind))
        read = numbers_of(kind) if isinstance(kind, Quantity) else by_kind
        option(to, words, about, read, default=key.default, **how)


def described(args: argparse.Namespace) -> bool:
    """Whether the file of the verb is a description."""
    return bool(args.file.suffix.lower() == TOML_SUFFIX)


def component(args: argparse.Namespace, *extra: str) -> "Component":
    """The component of the file, with what the command line changes but for extra options."""
    return rom.read_component(args.file, changes(args.given, PLACES, extra), **meshing(args))


def mechanism(args: argparse.Namespace, *extra: str) -> "MechanismFile":
    """The mechanism of the file, with what the command line changes but for extra options."""
    return rom.read_mechanism(args.file, changes(args.given, MOTION_KEYS, extra), **meshing(args))


def changes(
    given: dict[str, Any], places: dict[str, tuple[str, ...]], extra: tuple[str, ...]
) -> Changes:
    """What options say, by the keys of the file."""
    found: Changes = {}
    for name, value in given.items():
        if name in COMMON_OPTIONS or name in extra:
            continue
        if name in places:
            found |= dict.fromkeys(REPLACED_KEYS.get(name, ()))
            found[places[name]] = list(value) if isinstance(value, tuple) else value
        elif name in SPECIAL_KEYS and places is PLACES:
            found |= SPECIAL_KEYS[name](value)
        else:
            text = f"--{name.replace('_', '-')} does not go with a {TOML_SUFFIX} file"
            raise rom.ConfigError(f"{text}; write it there.")
    return found


def _each(option: str, pairs: Iterable[tuple[str, object]], *section: str) -> Changes:
    return {(*section, name): value for name, value in unique(list(pairs), option).items()}


def rayleigh(text: str) -> dict[str, float]:
    """The factors of D = alpha M + beta K."""
    try:
        alpha, beta = map(float, text.split(","))
    except ValueError:
        raise rom.ConfigError(
            f"--rayleigh {text} is not two numbers; write them as 0.1,1e-6, only with a comma."
        ) from None
    return {"alpha": alpha, "beta": beta}


SPECIAL_KEYS: dict[str, Callable[[Any], Changes]] = {
    "parameter": lambda pairs: _each("-p", map(number_or_text, pairs), "geometry", "parameters"),
    "interface": lambda pairs: _each("-i", pairs, "interfaces"),
    "face": lambda pairs: _each("--face", faces(pairs).items(), "geometry", "faces"),
    "unite": lambda _: {("geometry", "parameters", "unite"): 1},
    "rayleigh": lambda text: {("damping",): rayleigh(text)},
    "no_certificate": lambda _: {("reduction", "certificate"): False},
    "full_certificate": lambda _: {("reduction", "certificate"): "full"},
}
