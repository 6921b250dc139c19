"""Options that choose how a body is reduced."""

import argparse
from typing import TYPE_CHECKING

from rom.cli.options import count, number, positive
from rom.config.methods import CRAIG_BAMPTON, METHODS
from rom.errors import ConfigError

if TYPE_CHECKING:
    from rom.reduction.bases.method import Method
    from rom.reduction.interfaces.characteristic import Characteristic


def frequencies(text: str) -> tuple[float, ...]:
    """Numbers with commas."""
    return tuple(map(number, text.split(",")))


def add_method(parser: argparse.ArgumentParser) -> None:
    """What is kept of the body."""
    parser.add_argument(
        "--method",
        choices=METHODS,
        default=CRAIG_BAMPTON,
        help="craig-bampton (default), enhanced (the same, corrected), guyan (statics only), "
        "rubin or herting (free-free modes and statics), moment-matching (exact at --at), "
        "balanced (what the interfaces know of the modes), free-free (no joint may clamp it)",
    )
    kept = parser.add_mutually_exclusive_group()
    kept.add_argument(
        "-m",
        "--modes",
        type=count,
        help="modes kept (default 20); blocks per frequency for moment-matching (default 2)",
    )
    kept.add_argument(
        "--f-max", type=positive, help="craig-bampton: keep all modes up to this frequency [Hz]"
    )
    parser.add_argument(
        "--tol",
        type=positive,
        help="with --f-max: the fewest modes with this relative error of all frequencies in the "
        "band, e.g. 1e-3",
    )
    parser.add_argument(
        "--at", metavar="HZ,…", type=frequencies, help="moment-matching: where (default 0) [Hz]"
    )
    parser.add_argument(
        "--characteristic",
        metavar="N",
        type=count,
        help="full interfaces follow N characteristic constraint modes",
    )
    parser.add_argument(
        "--gravity-shapes",
        action="store_true",
        help="keep the answers to gravity along each axis (static correction)",
    )


def method(args: argparse.Namespace) -> "Method | Characteristic":
    """The method the options ask for.

    Raises:
        ConfigError: if they contradict each other.
    """
    from rom.reduction.bases.loads import WithLoads
    from rom.reduction.interfaces.characteristic import Characteristic

    chosen = _plain(args)
    if args.gravity_shapes:
        chosen = WithLoads(chosen)
    if args.characteristic is None:
        return chosen
    if not any(kind == "full" for _, kind in args.interface):
        raise ConfigError("--characteristic needs a full interface, as in -i tip=full.")
    return Characteristic(chosen, args.characteristic)


def _plain(args: argparse.Namespace) -> "Method":
    import rom

    _, name, default = METHODS[args.method]
    if args.f_max and args.method != CRAIG_BAMPTON:
        raise ConfigError(f"--f-max belongs to {CRAIG_BAMPTON}; give {args.method} a number -m.")
    if args.tol is not None and not args.f_max:
        raise ConfigError("--tol needs the band --f-max.")
    if args.at is not None and args.method != "moment-matching":
        raise ConfigError(f"--at belongs to moment-matching, not to {args.method}.")
    if default is None and args.modes is not None:
        raise ConfigError(f"{args.method} keeps no modes: leave -m out.")
    if args.f_max:
        return rom.CraigBampton(f_max=args.f_max, tol=args.tol)
    number_kept = () if default is None else (default if args.modes is None else args.modes,)
    if args.method == "moment-matching":
        return rom.MomentMatching(args.at or (0.0,), *number_kept)
    return getattr(rom, name)(*number_kept)
