"""Write a body in the format of another program; the ending of the file name chooses it.

A mechanism becomes a Functional Mock-up Unit, .fmu.
"""

import argparse
from functools import partial
from pathlib import Path

import rom
from rom.cli.answer import Answer
from rom.cli.described import described, mechanism
from rom.cli.options import DURATION, add_meshing, names, option
from rom.cli.output import add_force, checked, files_in

SUMMARY = "write a body or a mechanism for another program"
MECHANISM_OPTIONS = ("inputs", "outputs", "dt")
EXAMPLES = """\
  rom export rod.rom.npz rod.vtu        # mode shapes for ParaView
  rom export rod.rom.npz rod.SID_FEM    # Standard Input Data for Simpack
  rom export rod.rom.npz rod.sid --to sid-geisler
  rom export jacket.rom.npz jacket.dat --to openfast --held foot
  rom export rod.SID_FEM rod.rom.npz    # and back, without geometric stiffness
  rom export rod.fem rod.rom.npz        # from MBDyn
  rom export demos/slider_crank.toml crank.fmu --inputs motor
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="body, .rom.npz, .SID_FEM, .fem; or .toml")
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
    from rom.io.export import format_of, read_body
    from rom.io.files import check_writable

    check_writable(args.output)
    if described(args):
        file, kind = mechanism(args, "inputs", "outputs"), "fmu"
        checked(args, args.output, kind, inputs=files_in(file.values))
        what, ends = f"mechanism {file.name}", {"inputs": args.inputs, "outputs": args.outputs}
        write = partial[object](rom.write_mechanism_fmu, file, args.output, **ends)
    else:
        if wrong := [option for option in MECHANISM_OPTIONS if getattr(args, option)]:
            raise rom.ConfigError(f"--{wrong[0]} needs the .toml file of a mechanism.")
        kind = format_of(args.output, args.to)
        checked(args, args.output, kind)
        body = read_body(args.file)
        what = f"body {body.name}"
        write = partial(rom.export, body, args.output, to=kind, held=args.held)
    data = {"file": str(args.file), "output": str(args.output), "format": kind}
    return Answer(data, f"{args.output}: {what} as {kind}", write)
