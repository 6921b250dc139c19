"""Update a family of bodies by a vibration test, and say what the test can and cannot tell.

The family comes from `rom.reduce_parametric` and a file of `rom.save`. With -o the body at the
factors found is written.
"""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.cli.answer import Answer, failures, report_data
from rom.cli.options import assignment, count, names, number, positive, typed_number, unique
from rom.cli.output import add_force, checked
from rom.errors import ConfigError

if TYPE_CHECKING:
    from rom.updating import AddedMass, GroundSpring, Updated

SUMMARY = "update a family of bodies by a vibration test"
EXAMPLES = """\
  rom update test.uff --family panel.rom.npz --averages 50 --fixed root
  rom update test.csv --points points.csv --family panel.rom.npz --averages 50 --coherence 0.98
  rom update test.uff --family panel.rom.npz --averages 50 --free core,clamp \\
      --spring clamp=root:1e8,1e8,1e8:0.1:10 --mass cable=tip:0.05:0.1:10 --candidate cable \\
      -o updated.rom.npz
"""
FACTOR_HELP = "by a factor from LOW to HIGH that is sought; may be repeated"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="test: .uff, .unv, .csv, .txt or .h5")
    parser.add_argument("--family", type=Path, required=True, help="family file, .rom.npz")
    parser.add_argument("--averages", type=count, help="number of them behind each function")
    parser.add_argument("--coherence", type=number, help="of all values, where the file has none")
    parser.add_argument("--points", type=Path, help="another file with the nodes of the test")
    parser.add_argument("--fixed", metavar="NAME,...", type=names, default=(), help="what was held")
    parser.add_argument(
        "--free", metavar="NAME,...", type=names,
        help="unknown parameters (default: all); springs and masses are always",
    )  # fmt: skip
    parser.add_argument(
        "--spring", metavar="NAME=INTERFACE:KX,KY,KZ:LOW:HIGH", type=assignment, action="append",
        default=[], help=f"between an interface and the ground [N/m, N m/rad], {FACTOR_HELP}",
    )  # fmt: skip
    parser.add_argument(
        "--mass", metavar="NAME=INTERFACE:KG:LOW:HIGH", type=assignment, action="append",
        default=[], help=f"on an interface [kg], {FACTOR_HELP}",
    )  # fmt: skip
    parser.add_argument(
        "--candidate", metavar="NAME,...", type=names, default=(),
        help="springs and masses that the model has not, tried by their score",
    )  # fmt: skip
    parser.add_argument(
        "--prior", metavar="NAME=DEVIATION", type=assignment, action="append", default=[],
        help="relative standard deviation of a factor about one, before the test",
    )  # fmt: skip
    parser.add_argument(
        "--damping", type=positive, default=0.01, help="to start from (default 1 %%)"
    )
    parser.add_argument("--tolerance", type=positive, help="of points off the body [m]")
    parser.add_argument("-o", "--output", type=Path, help="updated body, .rom.npz")
    add_force(parser)


def run(args: argparse.Namespace) -> Answer:
    """Read, update, judge."""
    from rom.io.family import load, save
    from rom.io.responses.reading import read_responses
    from rom.parametric.family import BodyFamily
    from rom.updating.estimate import update

    output = args.output and checked(args, args.output, "npz")
    family = load(args.family)
    if not isinstance(family, BodyFamily):
        raise ConfigError(
            f"{args.family} holds one body, without parameters.",
            hint="Make a family with rom.reduce_parametric and write it with rom.save.",
        )
    test = read_responses(
        args.file, averages=args.averages, coherence=args.coherence, points=args.points
    )
    outside = _outside(args)
    if wrong := sorted(set(args.candidate) - set(outside)):
        raise ConfigError(f"--candidate {wrong[0]} is neither a --spring nor a --mass.")
    prior = unique(args.prior, "--prior")
    prior = {name: typed_number("--prior", text) for name, text in prior.items()}
    found = update(
        family, test, free=args.free, fixed=args.fixed, damping=args.damping,
        attached={name: part for name, part in outside.items() if name not in args.candidate},
        candidates={name: outside[name] for name in args.candidate},
        prior=prior,
        tolerance=args.tolerance,
    )  # fmt: skip
    write = None if output is None else lambda: save(found.body, output)
    text = f"{args.file}: {test.H.shape[1]} sensors, {test.H.shape[2]} forces, {len(test.H)} lines"
    return Answer(_data(args, found), f"{text}\n{found}", write, failures(found.verdict))


def _data(args: argparse.Namespace, found: "Updated") -> dict[str, Any]:
    deviations = found.deviations
    data = {
        "file": str(args.file),
        "family": str(args.family),
        "factors": found.factors,
        "damping": found.zeta.tolist(),
        "deviations": deviations,
        "scores": found.scores,
        "by_sensor": found.by_sensor.tolist(),
        "unseen": list(found.unseen),
        "at_bound": list(found.at_bound),
        "report": report_data(found.verdict),
    }
    return data | ({} if args.output is None else {"output": str(args.output)})


def _outside(args: argparse.Namespace) -> dict[str, "GroundSpring | AddedMass"]:
    """Springs and masses by their names.

    Raises:
        ConfigError: naming the option that is not as it is shown.
    """
    from rom.updating.family_model import AddedMass, GroundSpring

    found: dict[str, GroundSpring | AddedMass] = {}
    for name, text in unique(args.spring, "--spring").items():
        at, stiffness, low, high = _parts("--spring", text)
        k = [typed_number("--spring", part) for part in stiffness.split(",")]
        found[name] = GroundSpring(at, k, low, high)
    for name, text in unique(args.mass, "--mass").items():
        if name in found:
            raise ConfigError(f"{name} is a --spring and a --mass.")
        at, mass, low, high = _parts("--mass", text)
        found[name] = AddedMass(at, typed_number("--mass", mass), low, high)
    return found


def _parts(option: str, text: str) -> tuple[str, str, float, float]:
    parts = text.split(":")
    if len(parts) != 4:
        raise ConfigError(f"{option} {text!r} is not INTERFACE:VALUE:LOW:HIGH.")
    return parts[0], parts[1], typed_number(option, parts[2]), typed_number(option, parts[3])
