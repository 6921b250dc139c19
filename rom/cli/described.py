"""Components and mechanisms described by files: what a command line says goes before the file."""

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from rom.cli.options import faces, meshing, number_or_text, unique
from rom.errors import ConfigError

if TYPE_CHECKING:
    from rom.config.component import Component
    from rom.config.mechanism import MechanismFile

TOML_SUFFIX = ".toml"
COMMON_OPTIONS = {
    "verb", "file", "run", "output", "force", "json", "quiet", "verbose", "strict", "debug",
    "version", "resume", "parser",
}  # fmt: skip
COMMON_OPTIONS |= {"trust", "time_limit", "memory_limit"}  # no file may say them
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
REPLACED_KEYS = {  # an option takes the place of what contradicts it
    "modes": (("reduction", "f_max"), ("reduction", "tol")),
    "f_max": (("reduction", "modes"),),
    "tol": (("reduction", "modes"),),
    "damping_ratio": (("damping", "alpha"), ("damping", "beta")),
}


def described(args: argparse.Namespace) -> bool:
    """Whether the file of the verb is a description."""
    return bool(args.file.suffix.lower() == TOML_SUFFIX)


def component(args: argparse.Namespace, *extra: str) -> "Component":
    """The component of the file, with what the command line changes but for extra options."""
    from rom.config.component import read_component

    return read_component(args.file, changes(args.given, PLACES, extra), **meshing(args))


def mechanism(args: argparse.Namespace, *extra: str) -> "MechanismFile":
    """The mechanism of the file, with what the command line changes but for extra options."""
    from rom.config.mechanism import read_mechanism

    return read_mechanism(args.file, changes(args.given, MOTION_KEYS, extra), **meshing(args))


def changes(given: dict[str, Any], places: dict[str, tuple[str, ...]], extra: Any) -> Changes:
    """What options say, by the keys of the file."""
    found: Changes = {}
    for option, value in given.items():
        if option in COMMON_OPTIONS or option in extra:
            continue
        if option in places:
            found |= dict.fromkeys(REPLACED_KEYS.get(option, ()))
            found[places[option]] = list(value) if isinstance(value, tuple) else value
        elif option in SPECIAL_KEYS and places is PLACES:
            found |= SPECIAL_KEYS[option](value)
        else:
            name = "--" + option.replace("_", "-")
            raise ConfigError(
                f"{name} does not go with a {TOML_SUFFIX} file.", hint="Write it there."
            )
    return found


def _parameters(pairs: list[tuple[str, str]]) -> Changes:
    values = unique([number_or_text(pair) for pair in pairs], "-p")
    return {("geometry", "parameters", name): value for name, value in values.items()}


def _interfaces(pairs: list[tuple[str, str]]) -> Changes:
    return {("interfaces", name): kind for name, kind in unique(pairs, "-i").items()}


def _faces(pairs: list[tuple[str, str]]) -> Changes:
    return {("geometry", "faces", name): text for name, text in faces(pairs).items()}


def rayleigh(text: str) -> dict[str, float]:
    """The factors of D = alpha M + beta K."""
    try:
        alpha, beta = map(float, text.split(","))
    except ValueError:
        raise ConfigError(
            f"--rayleigh {text} is not two numbers; write them as 0.1,1e-6, only with a comma."
        ) from None
    return {"alpha": alpha, "beta": beta}


SPECIAL_KEYS: dict[str, Callable[[Any], Changes]] = {
    "parameter": _parameters,
    "interface": _interfaces,
    "face": _faces,
    "rayleigh": lambda text: {("damping",): rayleigh(text)},
    "no_certificate": lambda _: {("reduction", "certificate"): False},
    "full_certificate": lambda _: {("reduction", "certificate"): "full"},
}
