"""Reduce a finite element model to a flexible body and compare the two.

The body is written even when a quality figure fails, with that verdict inside; the exit code is
then 5.
"""

import argparse
from collections.abc import Iterable
from math import pi
from pathlib import Path
from typing import Any

import rom
from rom.cli.answer import Answer, Data, failures, report_data
from rom.cli.described import component, described, keyed, rayleigh
from rom.cli.matrices import add_matrices, read_model
from rom.cli.options import (
    add_geometry,
    add_interfaces,
    add_solid,
    option,
    require,
    solid_options,
    unique,
)
from rom.cli.output import add_force, checked, files_in
from rom.config.methods import SETTINGS, chosen
from rom.errors import ConfigError
from rom.names import check_name

SUMMARY = "reduce a model to a flexible body, with its certificate"
EXAMPLES = """\
  rom reduce meshes/connecting_rod.geo --E 210e9 --nu 0.3 --rho 7850 \\
      -i pin_a=rbe2 -i pin_b=rbe2 -m 20 --reference pin_a -o rod.rom.npz
  rom reduce meshes/beam.geo --E 70e9 --nu 0.33 --rho 2700 -i root=rbe2 -i tip=rbe3 \\
      --f-max 3e3 --reference root,tip --damping-ratio 0.01 --damping-fixed root -o beam.rom.npz
  rom reduce part.step --face bore=radius:0.006 --face foot=12 --E 210e9 --nu 0.3 --rho 7850 \\
      -i bore=rbe2 -i foot=rbe2 --reference foot -o part.rom.npz
  rom reduce rod.op4:KAA --mass rod.op4:MAA --nodes rod.bdf --units mm-t-s \\
      --set pin_a=11-14 --set pin_b=81-84 -i pin_a=rbe2 -i pin_b=rbe2 -o rod.rom.npz
  rom reduce meshes/connecting_rod.toml -m 30 -o rod.rom.npz   # options go before the file
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    add_geometry(parser)
    add_solid(parser)
    keyed(parser, "--degree", "--solver")
    add_interfaces(parser)
    add_matrices(parser)
    keyed(parser, "--method")
    keyed(parser.add_mutually_exclusive_group(), "-m --modes", "--f-max")
    keyed(parser, "--tol", "--at HZ,…", "--characteristic N", "--gravity-shapes")
    keyed(parser, "--reference NAME,...")
    damping = parser.add_mutually_exclusive_group()
    keyed(damping, "--damping-ratio")
    option(damping, "--rayleigh ALPHA,BETA", "D = ALPHA M + BETA K [1/s], [s]", str)
    keyed(parser, "--damping-fixed NAME,...", "--stiffening", "--name", "--stress")
    evidence = parser.add_mutually_exclusive_group()
    option(evidence, "--no-certificate", "skip the comparison")
    about = "full modes in every support, however long it takes"
    option(evidence, "--full-certificate", about)
    option(parser, "-o --output", "default: as the body is called, .rom.npz", Path)
    add_force(parser)


def run(args: argparse.Namespace) -> Answer:
    """Assemble, reduce, compare; the file is written at the end."""
    body, output = _described(args) if described(args) else _by_options(args)
    failed = failures(body.certificate) if body.certificate else ()
    return Answer(_data(body, output), _text(body, output), lambda: rom.save(body, output), failed)


def _checked(args: argparse.Namespace, output: Any, name: str, inputs: Iterable[Path] = ()) -> Path:
    check_name(name, "a body")
    return checked(args, output or Path(f"{name}.rom.npz"), "npz", inputs=inputs)


def _described(args: argparse.Namespace) -> "tuple[rom.FlexibleBody, Path]":
    part = component(args)
    output = _checked(args, args.output or part.output, part.name, files_in(part.values))
    return part.body(), output


def _by_options(args: argparse.Namespace) -> "tuple[rom.FlexibleBody, Path]":
    needed = solid_options(args) | {"-i/--interface": args.interface}
    require(needed, "A body needs an interface, for example -i pin_a=rbe2.")
    name = args.name or args.file.stem
    output = _checked(args, args.output, name)
    settings = {key: getattr(args, key) for key in SETTINGS if getattr(args, key) is not None}
    method = chosen(settings, full=any(kind == "full" for _, kind in args.interface))
    damping = _damping(args)
    body = rom.reduce(
        read_model(args),
        method=method,
        interfaces=unique(args.interface, "-i"),
        reference=args.reference[0] if len(args.reference) == 1 else args.reference,
        damping=damping,
        name=name,
        stress=args.stress,
        stiffening=args.stiffening,
        certify="full" if args.full_certificate else not args.no_certificate,
    )
    return body, output


def _damping(args: argparse.Namespace) -> "rom.Rayleigh | rom.ModalDamping | None":
    if args.damping_ratio is not None:
        return rom.ModalDamping(args.damping_ratio, args.damping_fixed)
    if args.damping_fixed:
        raise ConfigError("--damping-fixed says where a ratio is meant: it needs --damping-ratio.")
    return None if args.rayleigh is None else rom.Rayleigh(**rayleigh(args.rayleigh))


def _data(body: "rom.FlexibleBody", output: Path) -> Data:
    return {
        "output": str(output),
        "name": body.name,
        "mass": body.mass,
        "n_modes": body.n_modes,
        "reference": body.reference,
        "interfaces": list(body.interface_names),
        "geometric stiffness": list(body.K_geo),
        "frequencies": (body.omega / (2 * pi)).tolist(),
        "certificate": None if body.certificate is None else report_data(body.certificate),
        "provenance": body.provenance,
    }


def _text(body: "rom.FlexibleBody", output: Path) -> str:
    full = body.provenance["reduction"]["full dofs"]
    head = (
        f"{output}: body {body.name}, {body.mass:.6g} kg, {full} dofs reduced to "
        f"6 + {body.n_modes}, frame {body.reference}"
    )
    if body.certificate is None:
        return head
    compared = body.provenance["comparison"].items()
    lowest = ", ".join(f"{support} {table['reduced'][0]:.5g} Hz" for support, table in compared)
    about = f"lowest elastic frequency: {lowest}; it depends on how the body is held"
    return f"{head}\n{about}\n\n{body.certificate}"
