"""Update a family of bodies by a vibration test, and say what the test can and cannot tell.

The family comes from `rom.reduce_parametric` and a file of `rom.save`. With -o the body at the
factors found is written. With --plan and no test, the sensors and forces that will tell most are
chosen, and written with -o.
"""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.cli.answer import Answer, failures, report_data
from rom.cli.options import (
    assignment,
    count,
    names,
    number,
    positive,
    require,
    typed_number,
    unique,
)
from rom.cli.output import add_force, checked
from rom.errors import ConfigError

if TYPE_CHECKING:
    from rom.parametric.family import BodyFamily
    from rom.updating import AddedMass, Channels, GroundSpring, Responses, Updated

SUMMARY = "update a family of bodies by a vibration test"
EXAMPLES = """\
  rom update test.uff --family panel.rom.npz --averages 50 --fixed root
  rom update test.csv --points points.csv --family panel.rom.npz --averages 50 --coherence 0.98 \\
      --picture points.png
  rom update test.uff --family panel.rom.npz --averages 50 --free core,clamp \\
      --spring clamp=root:1e8,1e8,1e8:0.1:10 --mass cable=tip:0.05:0.1:10 --candidate cable \\
      -o updated.rom.npz
  rom update test.uff --family panel.rom.npz --averages 50 --residual equations --prior core=0.3
  rom update --plan 8,1 --lines 20:800 --family panel.rom.npz --fixed root -o plan.csv
  rom update --plan --lines 20:800 --family panel.rom.npz --fixed root -o plan.png
"""
PLAN_LINES = 100  # between the first and the last one
PLAN_POINTS = 20  # of the surface that are offered, each along three axes
PLAN_ENDINGS = (".csv", ".uff", ".png")
PLAN_SIZE = (8, 1)  # sensors and forces, where none are asked for
PIN_RATIO = 0.12  # length of a pin in a picture, over the size of the body
PIN_SLENDERNESS = 12.0  # of a pin; its ball is three times as thick
FACTOR_HELP = "by a factor from LOW to HIGH that is sought; may be repeated"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, nargs="?", help="test: .uff, .unv, .csv, .txt or .h5")
    parser.add_argument("--family", type=Path, required=True, help="family file, .rom.npz")
    parser.add_argument("--averages", type=count, help="number of them behind each function")
    parser.add_argument("--coherence", type=number, help="of all values, where the file has none")
    parser.add_argument(
        "--force-noise", type=positive, help="on the signal of a force, over the force itself"
    )
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
        "--residual", choices=("responses", "equations", "response-function"), default="responses",
        help="what is made small: responses (default), equations of motion at the sensors, or what "
        "the response function method leaves",
    )  # fmt: skip
    parser.add_argument(
        "--rank", type=count, help="of the basis of equations (default: one per mode of the band)"
    )
    parser.add_argument(
        "--damping", type=positive, default=0.01, help="to start from (default 1 %%)"
    )
    parser.add_argument("--tolerance", type=positive, help="of points off the body [m]")
    parser.add_argument(
        "--picture", type=Path, help="of the points of a test on the body, .png, drawn first"
    )
    parser.add_argument(
        "--plan", metavar="SENSORS,FORCES", type=_two_counts, nargs="?", const=PLAN_SIZE,
        help="choose so many for a test to be (8,1 where they are left out)",
    )  # fmt: skip
    parser.add_argument(
        "--lines", metavar="LOW:HIGH", type=_range, help="of the test that is planned [Hz]"
    )
    parser.add_argument(
        "--noise", type=positive, default=0.05, help="relative, of what is planned (default 5 %%)"
    )
    parser.add_argument(
        "--floor", type=number,
        help="noise of what is planned where nothing moves [m/s^2 per N] (default: a thousandth of "
        "the largest response)",
    )  # fmt: skip
    parser.add_argument(
        "-o", "--output", type=Path, help="updated body, .rom.npz; plan, .csv, .uff or .png"
    )
    add_force(parser)


def run(args: argparse.Namespace) -> Answer:
    """Read, update, judge."""
    from rom.io.family import save
    from rom.io.responses.reading import read_responses
    from rom.updating.estimate import update

    if args.plan is not None:
        return _plan(args)
    require({"file": args.file}, hint="A test, or --plan for one that is to be made.")
    output = args.output and checked(args, args.output, "npz")
    family = _family(args)
    test = read_responses(
        args.file, averages=args.averages, coherence=args.coherence, points=args.points
    )
    if args.picture is not None:
        _match(args, family, test)
    if args.force_noise is not None:
        test = replace(test, force_noise=args.force_noise)
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
        residual=args.residual,
        rank=args.rank,
    )  # fmt: skip
    write = None if output is None else lambda: save(found.body, output)
    text = f"{args.file}: {test.H.shape[1]} sensors, {test.H.shape[2]} forces, {len(test.H)} lines"
    return Answer(_data(args, found), f"{text}\n{found}", write, failures(found.verdict))


def _family(args: argparse.Namespace) -> "BodyFamily":
    from rom.io.family import load
    from rom.parametric.family import BodyFamily

    family = load(args.family)
    if not isinstance(family, BodyFamily):
        raise ConfigError(
            f"{args.family} holds one body, without parameters.",
            hint="Make a family with rom.reduce_parametric and write it with rom.save.",
        )
    return family


def _plan(args: argparse.Namespace) -> Answer:
    """Choose the channels of a test.

    Raises:
        ConfigError: for a test that is there, no lines, or an output of another kind.
    """
    import numpy as np

    from rom.updating.placement import candidates, place

    if args.file is not None or args.candidate:
        raise ConfigError("--plan takes neither a test nor --candidate: it comes before the test.")
    require({"--lines": args.lines}, hint="For example --lines 20:800, from 20 to 800 Hz.")
    output = args.output and checked(args, args.output)
    if output and output.suffix.lower() not in PLAN_ENDINGS:
        raise ConfigError(f"-o {output}: a plan is written as {', '.join(PLAN_ENDINGS)}.")
    family = _family(args)
    offered = candidates(family.body, PLAN_POINTS, fixed=args.fixed)
    n_sensors, n_inputs = args.plan
    low, high = args.lines
    prior = unique(args.prior, "--prior")
    plan = place(
        family, offered, offered, np.linspace(low, high, PLAN_LINES), n_sensors=n_sensors,
        n_inputs=n_inputs, noise=args.noise, floor=args.floor, fixed=args.fixed,
        attached=_outside(args), damping=args.damping,
        prior={name: typed_number("--prior", text) for name, text in prior.items()},
    )  # fmt: skip
    channels = (("sensors", plan.sensors), ("inputs", plan.inputs))
    placed = {
        name: [[*x, *d] for x, d in zip(np.asarray(c.points).tolist(),
                                        np.asarray(c.directions).tolist(), strict=True)]
        for name, c in channels
    }  # fmt: skip
    data = {
        "family": str(args.family),
        "plan": placed,
        "deviations": plan.deviations,
        "unseen": list(plan.unseen),
    }
    if not output:
        return Answer(data, f"{plan}\n{plan.csv()}")
    if output.suffix.lower() == ".png":
        left = ", ".join(f"{name} to {100 * d:.2g} %" for name, d in plan.deviations.items()
                         if name in family.parameters)  # fmt: skip
        title, more = "Plan of a vibration test", f"The test will leave deviations: {left}."
        return Answer(
            data | {"output": str(output)}, str(plan),
            lambda: _drawn(family, (plan.sensors, plan.inputs), output, title, more),
        )  # fmt: skip
    text = plan.uff() if output.suffix.lower() == ".uff" else plan.csv()
    return Answer(
        data | {"output": str(output)}, str(plan), lambda: output.write_text(text, "ascii")
    )


def _match(args: argparse.Namespace, family: "BodyFamily", test: "Responses") -> None:
    """Draw where the points of a test are, also of one that does not belong to the body.

    Raises:
        ConfigError: for a picture of another kind, or one that must not be replaced.
        ModelError: if the body carries no surface.
    """
    import numpy as np
    from scipy.spatial import cKDTree

    from rom.body.surface import surface_of

    path = checked(args, args.picture)
    if path.suffix.lower() != ".png":
        raise ConfigError(f"--picture {path}: it is written as .png.")
    points = np.vstack([test.sensors.points, test.inputs.points])
    far = cKDTree(surface_of(family.body).points).query(points)[0]
    _drawn(
        family, (test.sensors, test.inputs), path, "Points of a vibration test",
        f"Largest distance of the {len(points)} points from one of the surface: {far.max():.3g} m.",
    )  # fmt: skip


def _drawn(
    family: "BodyFamily",
    channels: "tuple[Channels, Channels]",
    path: Path,
    title: str,
    more: str,
) -> None:
    """A picture of the body with a pin along each channel, its ball where it is mounted."""
    import numpy as np

    from rom import view
    from rom.body.surface import surface_of

    surface = surface_of(family.body)
    length = PIN_RATIO * float(np.ptp(surface.points, axis=0).max())
    thick = length / PIN_SLENDERNESS
    things = {"body": (surface.points, surface.triangles)}
    for name, several in zip(("sensors", "forces"), channels, strict=True):
        pins = []
        for x, d in zip(np.asarray(several.points), np.asarray(several.directions), strict=True):
            pins += [view.cylinder(x, x + length * d / np.linalg.norm(d), thick, sides=12)]
            pins += [view.ellipsoid((1.5 * thick,) * 3, x, sides=12)]
        things[name] = view.joined(pins)
    view.plane(
        [view.Scene(f"Seen from {side}", things, view=(0.6 * y, y, 0.7 * z), up=(0, 0, 1))
         for side, y, z in (("the front and above", -1.0, 1.0), ("behind and below", 1.0, -1.0))],
        path, title=title,
        caption="A ball marks a point, its pin the direction, in the axes of the geometry; a "
        f"point may carry several. {more}",
    )  # fmt: skip


def _two_counts(text: str) -> tuple[int, int]:
    parts = text.split(",")
    if len(parts) != 2:
        raise argparse.ArgumentTypeError(f"{text!r} is not two whole numbers, as in 8,1")
    return count(parts[0]), count(parts[1])


def _range(text: str) -> tuple[float, float]:
    parts = text.split(":")
    if len(parts) != 2:
        raise argparse.ArgumentTypeError(f"{text!r} is not LOW:HIGH, as in 20:800")
    low, high = map(positive, parts)
    if not low < high:
        raise argparse.ArgumentTypeError(f"{text!r} does not ascend")
    return low, high


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
