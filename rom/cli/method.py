"""Options that choose how a body is reduced."""

import argparse
from typing import TYPE_CHECKING

from rom.cli.options import count, number, positive
from rom.config.methods import CRAIG_BAMPTON, METHODS, SETTINGS, chosen

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
        "balanced (what the interfaces know of the modes), free-free (no joint may clamp it), "
        "assumed (modes under the --reference alone)",
    )
    kept = parser.add_mutually_exclusive_group()
    kept.add_argument(
        "-m",
        "--modes",
        type=count,
        help="modes kept; if missing, as many as the certificate needs for craig-bampton, 20 for "
        "others; blocks per frequency for moment-matching (default 2)",
    )
    kept.add_argument(
        "--f-max", type=positive, help="craig-bampton: keep all modes up to this frequency [Hz]"
    )
    parser.add_argument(
        "--tol",
        type=positive,
        help="craig-bampton: the fewest modes with this relative error of all frequencies up to "
        "--f-max, or else of the lowest six in every support (default 5e-4)",
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
    settings = {key: getattr(args, key) for key in SETTINGS if getattr(args, key) is not None}
    return chosen(settings, full=any(kind == "full" for _, kind in args.interface))
