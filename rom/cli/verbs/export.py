"""Write a body in the format of another program; the ending of the file name chooses it.

A mechanism becomes a Functional Mock-up Unit, .fmu.
"""

import argparse
from pathlib import Path

import rom
from rom.cli.answer import Answer
from rom.cli.described import described, mechanism
from rom.cli.options import DURATION, add_meshing, names, option
from rom.cli.output import add_force, checked, files_in
from rom.errors import ConfigError

SUMMARY = "write a body or a mechanism for another program"
MECHANISM_OPTIONS = ("inputs", "outputs", "dt")
EXAMPLES = """\
  rom export rod.rom.npz rod.vtu        # mode shapes for ParaView
  rom export rod.rom.npz rod.SID_FEM    # Standard Input Data for Simpack
  rom export rod.rom.npz rod.sid --to sid-geisler
  rom export jacket.rom.npz jacket.dat --to openfast --held foot
  rom export rod.SID_FEM rod.rom.npz    # and back, without geometric stiffness
  rom export demos/slider_crank.toml crank.fmu --inputs motor
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="body, .rom.npz or .SID_FEM; mechanism, .toml")
    parser.add_argument("output", type=Path, help="file to write")
    option(parser, "--to FORMAT", "format, if the ending does not tell", str)
    option(parser, "--held NAME,...", "interfaces held, for openfast", names)
    about = "loads, motors, drives of a mechanism that follow inputs"
    option(parser, "--inputs NAME,...", about, names)
    about = "body.marker, joints, drives of a mechanism; all if missing"
    option(parser, "--outputs NAME,...", about, names, default=None)
    option(parser, "--dt", "longest time step of a mechanism [s]", DURATION)
    add_force(parser)
    add_meshing(parser)


def run(args: argparse.Namespace) -> Answer:
    """Load; the file is written at the end."""
    return _mechanism(args) if described(args) else _body(args)


def _mechanism(args: argparse.Namespace) -> Answer:
    from rom.io.files import check_writable

    check_writable(args.output)
    file = mechanism(args, "inputs", "outputs")
    checked(args, args.output, "fmu", inputs=files_in(file.values))
    data = {"file": str(args.file), "output": str(args.output), "format": "fmu"}
    text = f"{args.output}: mechanism {file.name} as fmu"
    ends = {"inputs": args.inputs, "outputs": args.outputs}
    return Answer(data, text, lambda: rom.write_mechanism_fmu(file, args.output, **ends))


def _body(args: argparse.Namespace) -> Answer:
    from rom.io.export import format_of, read_body
    from rom.io.files import check_writable

    if wrong := [option for option in MECHANISM_OPTIONS if getattr(args, option)]:
        raise ConfigError(f"--{wrong[0]} needs the .toml file of a mechanism.")
    check_writable(args.output)
    kind = format_of(args.output, args.to)
    checked(args, args.output, kind)
    body = read_body(args.file)
    data = {"file": str(args.file), "output": str(args.output), "format": kind}
    text = f"{args.output}: body {body.name} as {kind}"
    return Answer(data, text, lambda: rom.export(body, args.output, to=kind, held=args.held))
