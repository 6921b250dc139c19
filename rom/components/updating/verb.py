"""Update a family of bodies by a vibration test, and say what the test can and cannot tell.

The family comes from `rom.reduce_parametric` and a file of `rom.save`. With -o the body at the
factors found is written. With --plan and no test, the sensors and forces that will tell most are
chosen, and written with -o. Several families NAME=FILE are an assembly: its places are
BODY.INTERFACE, and -o writes one body of each, with its name before the ending.
"""

import argparse
from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.cli import options
from rom.cli.answer import Answer, failures, report_data
from rom.cli.options import assignment, count, names, number, option, positive, unique
from rom.cli.output import add_force, checked
from rom.cli.schemas import FILE, OUTPUT, REPORT, by_name, each, record
from rom.cli.schemas import number as ratio
from rom.cli.schemas import text as words
from rom.errors import ConfigError
from rom.names import check_ending, named

if TYPE_CHECKING:
    from rom.components.updating.family_model import Attached, Family
    from rom.components.updating.placement import Plan
    from rom.components.updating.verdict import Updated

SUMMARY = "update a family of bodies by a vibration test"
EXAMPLES = """\
  rom update test.uff --family panel.rom.npz --averages 50 --fixed root
  rom update test.csv --points points.csv --family panel.rom.npz --averages 50 --coherence 0.98 \\
      --picture points.png
  rom update test.uff --family panel.rom.npz --averages 50 --free core,clamp \\
      --spring clamp=root:1e8,1e8,1e8:0.1:10 --mass cable=tip:0.05:0.1:10 --candidate cable \\
      -o updated.rom.npz
  rom update test.uff --family panel.rom.npz --averages 50 --residual equations --prior core=0.3
  rom update test.h5 --family frame=frame.rom.npz --family arm=arm.rom.npz --fixed frame.root \\
      --joint bolts=frame.tip,arm.root:4e8,4e8,4e8,2e5,1e5,1e5:0.1:10
  rom update --plan 8,1 --lines 20:800 --family panel.rom.npz --fixed root -o plan.csv
  rom update --plan --lines 20:800 --family panel.rom.npz --fixed root -o plan.png
"""
PLAN_LINES = 100  # between the first and the last one
PLAN_POINTS = 20  # of the surface that are offered, each along three axes
PLAN_ENDINGS = (".csv", ".uff", ".png")
PLAN_SIZE = (8, 1)  # sensors and forces, where none are asked for
RESIDUALS = ("responses", "equations", "response-function")
POINT_KEY = each(ratio("[m] and direction"), "x, y, z, dx, dy, dz")
SCHEMA = record(
    "what a test says about a family of bodies; with --plan, what one will say",
    optional=tuple("file factors damping scores by_sensor at_bound report plan output".split()),
    file=FILE,
    family=words("the family read"),
    factors=by_name(ratio("factor"), "all parameters; 0 for a candidate, not in the model"),
    damping=each(ratio("ratio"), "of the lowest elastic modes, the last of all others"),
    deviations=by_name(ratio("relative"), "standard deviation of each unknown"),
    scores=by_name(ratio("deviations"), "by which the data ask for what was not updated"),
    by_sensor=each(ratio("ratio"), "mean squared residual over its expectation"),
    unseen=each(by_name(ratio("share"), "a direction"), "directions the data do not see"),
    at_bound=each(words("parameter"), "those at an end of their range"),
    report=REPORT,
    plan=record(
        "channels of a test: point [m] and direction",
        sensors=each(POINT_KEY, "sensors"),
        inputs=each(POINT_KEY, "forces"),
    ),
    output=OUTPUT,
)


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


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options: the model and what of it is unknown, what was measured, the search, and the plan."""
    add = partial(option, parser)
    about = "family file, .rom.npz; of several, repeated, each with a name: an assembly"
    takes = "FILE or NAME=FILE"
    parser.add_argument("--family", metavar=takes, action="append", required=True, help=about)
    add("--couple BODY.INTERFACE=BODY.INTERFACE", "of an assembly: they move together", assignment)
    add("--fixed NAME,...", "what was held", names)
    about = "unknown parameters (default: all); springs and masses are always"
    add("--free NAME,...", about, names, default=None)
    by = "by a factor from LOW to HIGH that is sought; may be repeated"
    about = f"[N/m, N m/rad], {by}"
    add("--spring NAME=INTERFACE:KX,KY,KZ:LOW:HIGH", f"interface to ground {about}", assignment)
    joint = "--joint NAME=BODY.INTERFACE,BODY.INTERFACE:KX,KY,KZ:LOW:HIGH"
    add(joint, f"between bodies {about}", assignment)
    add("--mass NAME=INTERFACE:KG:LOW:HIGH", f"on an interface [kg], {by}", assignment)
    about = "springs and masses that the model has not, tried by their score"
    add("--candidate NAME,...", about, names)
    about = "NAME's relative standard deviation about one, before the test"
    add("--prior NAME=DEVIATION", about, assignment)
    parser.add_argument("file", type=Path, nargs="?", help="test: .uff, .unv, .csv, .txt or .h5")
    add("--averages", "number of them behind each function", count)
    add("--coherence", "of all values, where the file has none", number)
    add("--force-noise", "on the signal of a force, over the force itself", positive)
    about = "that the functions are, where it matters"
    add("--estimator", about, str, choices=("H1", "H2", "Hv"))
    add("--points", "another file with nodes, and bodies of an assembly", Path)
    add("--tolerance", "of points off the body [m]", positive)
    add("--picture", "of the points of a test on the body, .png, drawn first", Path)
    about = (
        "what is made small: responses (default), equations of motion at the sensors, or what the "
        "response function method leaves"
    )
    add("--residual", about, str, choices=RESIDUALS, default=RESIDUALS[0])
    add("--rank", "of the basis of equations (default: one per mode of the band)", count)
    about = "half bandwidths of the poles within which lines count less"
    add("--beside-poles WIDTH", about, positive)
    add("--damping", "to start from (default 1 %%)", positive, default=0.01)
    about = "choose so many for a test to be (8,1 where they are left out)"
    add("--plan SENSORS,FORCES", about, _two_counts, nargs="?", const=PLAN_SIZE)
    add("--lines LOW:HIGH", "of the test that is planned [Hz]", _range)
    add("--noise", "relative, of what is planned (default 5 %%)", positive, default=0.05)
    about = (
        "noise of what is planned where nothing moves [m/s^2 per N] (default: a thousandth of the "
        "largest response)"
    )
    add("--floor", about, number)
    add("-o --output", "updated body, .rom.npz; plan, .csv, .uff or .png", Path)
    add_force(parser)


def run(args: argparse.Namespace) -> Answer:
    """Read, update, judge."""
    from rom.components.updating.estimate import update
    from rom.components.updating.responses.reading import read_responses
    from rom.io.bodies import save

    if args.plan is not None:
        return _plan(args)
    options.require({"file": args.file}, hint="A test, or --plan for one that is to be made.")
    family = _family(args)
    outputs = _outputs(args)
    read = {name: getattr(args, name) for name in ("averages", "coherence", "points")}
    bodies = list(filter(None, _files(args)))
    test = read_responses(args.file, **read, bodies=bodies)
    if args.picture is not None:
        from rom.components.updating.pictures import match

        match(family, test, checked(args, args.picture, inputs=_files(args).values()))
    noise = {"force_noise": args.force_noise, "estimator": args.estimator}
    test = replace(test, **{name: value for name, value in noise.items() if value is not None})
    common = _common(args)
    outside = common.pop("attached")
    if wrong := sorted(set(args.candidate) - set(outside)):
        raise ConfigError(f"--candidate {wrong[0]} must name a --spring, --joint or --mass.")
    candidates = {name: outside.pop(name) for name in dict.fromkeys(args.candidate)}
    search = ("free", "tolerance", "residual", "rank", "beside_poles")
    common |= {name: getattr(args, name) for name in search}
    found = update(family, test, **common, attached=outside, candidates=candidates)

    def write() -> None:
        bodies = {"": found.body} if "" in outputs else found.assembly.bodies
        for name, path in outputs.items():
            save(bodies[name], path)

    text = f"{args.file}: {test.H.shape[1]} sensors, {test.H.shape[2]} forces, {len(test.H)} lines"
    data = _data(args, found) | {
        "file": str(args.file),
        "factors": found.factors,
        "damping": found.zeta.tolist(),
        "scores": found.scores,
        "by_sensor": found.by_sensor.tolist(),
        "at_bound": list(found.at_bound),
        "report": report_data(found.verdict),
    }
    return Answer(data, f"{text}\n{found}", write if outputs else None, failures(found.verdict))


def _outputs(args: argparse.Namespace) -> dict[str, Path]:
    """{name: file} of the bodies that are written; one alone has no name."""
    if args.output is None:
        return {}
    if not args.output.name:
        raise ConfigError("-o must name a file.")
    stem, paths = args.output.name.removesuffix(".npz").removesuffix(".rom"), {}
    files = _files(args)
    for name in files:
        path = args.output.with_name(f"{stem}.{name}.rom.npz") if name else args.output
        paths[name] = checked(args, path, "npz", inputs=files.values())
    return paths


def _files(args: argparse.Namespace) -> dict[str, Path]:
    """{name: file} of the families; one alone has no name."""
    pairs = []
    for text in args.family:
        name, _, file = text.partition("=")
        pairs.append(("", text) if not file or Path(text).exists() else (name, file))
    if len(pairs) > 1 and not all(name for name, _ in pairs):
        given = ", ".join(file for name, file in pairs if not name)
        text = f"--family {given}: of several each has a name."
        raise ConfigError(text, hint="Write --family NAME=FILE.")
    return {name: Path(file) for name, file in unique(pairs, "--family").items()}


def _family(args: argparse.Namespace) -> "Family":
    """The family, or the assembly of several."""
    from rom.components.families.assembled import FamilyAssembly
    from rom.components.families.family import BodyFamily
    from rom.io.bodies import load

    families = {name: load(file) for name, file in _files(args).items()}
    for name, family in families.items():
        if not isinstance(family, BodyFamily):
            text = f"{_files(args)[name]} holds one body, without parameters."
            hint = "Make a family with rom.reduce_parametric and write it with rom.save."
            raise ConfigError(text, hint=hint)
    if "" in families:
        if args.couple or args.joint:
            raise ConfigError("--couple and --joint need an assembly of several families.")
        return families[""]
    pairs = tuple(tuple(_place("--couple", x, families) for x in pair) for pair in args.couple)
    return FamilyAssembly(families, pairs)


def _place(option: str, text: str, bodies: Collection[str]) -> Any:
    """The interface of a body alone, (body, interface) of an assembly."""
    if "" in bodies:
        return text
    for name in bodies:
        if text.startswith(f"{name}."):
            return name, text.removeprefix(f"{name}.")
    raise ConfigError(f"{option} {text!r} must be BODY.INTERFACE, of {named(bodies)}.")


def _common(args: argparse.Namespace) -> dict[str, Any]:
    """What an update and a plan know of a family before the test."""
    prior = unique(args.prior, "--prior")
    return {
        "fixed": tuple(_place("--fixed", text, _files(args)) for text in args.fixed),
        "attached": _outside(args),
        "damping": args.damping,
        "prior": {name: options.typed_number("--prior", text) for name, text in prior.items()},
    }


def _plan(args: argparse.Namespace) -> Answer:
    import numpy as np

    from rom.components.updating.placement import candidates, place
    from rom.io.files import write_whole

    if args.file is not None or args.candidate:
        raise ConfigError("--plan takes neither a test nor --candidate: it comes before the test.")
    options.require({"--lines": args.lines}, hint="For example --lines 20:800, from 20 to 800 Hz.")
    output = args.output and checked(args, args.output)
    if output:
        check_ending(output, "a plan", *PLAN_ENDINGS)
    family = _family(args)
    common = _common(args)
    offered = candidates(family, PLAN_POINTS, fixed=common["fixed"])
    (n_sensors, n_inputs), (low, high) = args.plan, args.lines
    lines = np.linspace(low, high, PLAN_LINES)
    common |= {"n_sensors": n_sensors, "n_inputs": n_inputs}
    plan = place(family, offered, offered, lines, noise=args.noise, floor=args.floor, **common)
    data = _data(args, plan) | {
        "plan": {
            name: np.hstack([several.points, several.directions]).tolist()
            for name, several in (("sensors", plan.sensors), ("inputs", plan.inputs))
        }
    }
    if not output:
        return Answer(data, f"{plan}\n{plan.csv()}")

    def write() -> None:
        if output.suffix.lower() == ".png":
            from rom.components.updating.pictures import drawn

            own = [(name, d) for name, d in plan.deviations.items() if name in family.parameters]
            left = ", ".join(f"{name} to {100 * d:.2g} %" for name, d in own)
            title, more = "Plan of a vibration test", f"The test will leave deviations: {left}."
            drawn(family, (plan.sensors, plan.inputs), output, title, more)
        else:
            text = plan.uff() if output.suffix.lower() == ".uff" else plan.csv()
            write_whole(output, lambda out: out.write(text.encode()))

    return Answer(data, str(plan), write)


def _data(args: argparse.Namespace, found: "Updated | Plan") -> dict[str, Any]:
    data = {"family": ", ".join(args.family), "deviations": found.deviations}
    data |= {} if args.output is None else {"output": str(args.output)}
    return data | {"unseen": list(found.unseen)}


def _outside(args: argparse.Namespace) -> "Attached":
    """Springs, joints and masses by their names."""
    from rom.components.updating.family_model import AddedMass, GroundSpring, JointSpring

    bodies, found = _files(args), dict[str, Any]()
    kinds: dict[str, Callable[..., object]] = {"--spring": GroundSpring, "--joint": JointSpring}
    kinds["--mass"] = AddedMass
    for flag, kind in kinds.items():
        for name, text in unique(getattr(args, flag[2:]), flag).items():
            shown = f"{flag} {text!r}"
            if name in found:
                raise ConfigError(f"{flag} {name} needs a name of its own.")
            if len(parts := text.split(":")) != 4:
                raise ConfigError(f"{shown} must be written INTERFACE:VALUE:LOW:HIGH.")
            places = [_place(flag, part, bodies) for part in parts[0].split(",")]
            if len(places) != (n := 1 + (flag == "--joint")):
                raise ConfigError(f"{shown} names {len(places)} places, needed are {n}.")
            low, high = (options.typed_number(flag, part) for part in parts[2:])
            value = [options.typed_number(flag, part) for part in parts[1].split(",")]
            if flag == "--mass" and len(value) != 1:
                raise ConfigError(f"{shown}: a mass must be one number [kg].")
            found[name] = kind(*places, value[0] if flag == "--mass" else value, low, high)
    return found
