"""Reduce a finite element model to a flexible body and compare the two.

The body is written even when a quality figure fails, with that verdict inside; the exit code is
then 5.
"""

import argparse
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.cli.answer import Answer, failures, report_data
from rom.cli.options import (
    add_geometry,
    add_interfaces,
    add_material,
    count,
    names,
    number,
    positive,
    read_model,
    unique,
)
from rom.errors import ConfigError

if TYPE_CHECKING:
    from rom.body.damping import ModalDamping, Rayleigh
    from rom.body.flexible import FlexibleBody
    from rom.reduction.method import Method

METHODS = ("craig-bampton", "enhanced", "guyan", "rubin", "herting", "free-free")
SUMMARY = "reduce a model to a flexible body, with its certificate"
EXAMPLES = """\
  rom reduce meshes/connecting_rod.geo --E 210e9 --nu 0.3 --rho 7850 \\
      -i pin_a=rbe2 -i pin_b=rbe2 -m 20 --reference pin_a -o rod.rom.npz
  rom reduce meshes/beam.geo --E 70e9 --nu 0.33 --rho 2700 -i root=rbe2 -i tip=rbe3 \\
      --f-max 3e3 --reference root,tip --damping-ratio 0.01 -o beam.rom.npz
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    add_geometry(parser)
    add_material(parser)
    add_interfaces(parser)
    parser.add_argument(
        "--method",
        choices=METHODS,
        default=METHODS[0],
        help="craig-bampton (default), enhanced (the same, corrected), guyan (statics only), "
        "rubin or herting (free-free modes and statics), free-free (no joint may clamp it)",
    )
    kept = parser.add_mutually_exclusive_group()
    kept.add_argument("-m", "--modes", type=count, help="modes kept (default 20)")
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
        "--reference",
        metavar="FRAME",
        type=names,
        default=("mean-axis",),
        help="frame: mean-axis, an interface, or two interfaces A,B (default mean-axis)",
    )
    damping = parser.add_mutually_exclusive_group()
    damping.add_argument("--damping-ratio", type=number, help="of every mode, e.g. 0.01")
    damping.add_argument("--rayleigh", metavar="ALPHA,BETA", help="D = ALPHA M + BETA K [1/s], [s]")
    parser.add_argument("--name", help="name of the body (default: that of the file)")
    parser.add_argument("--no-certificate", action="store_true", help="skip the comparison")
    parser.add_argument("-o", "--output", type=Path, required=True, help="e.g. rod.rom.npz")


def run(args: argparse.Namespace) -> Answer:
    """Assemble, reduce, compare; the file is written at the end."""
    from rom.io.files import check_writable
    from rom.io.native import save
    from rom.workflow import reduce

    check_writable(args.output)
    method, damping = _method(args), _damping(args)
    kinds = unique(args.interface, "-i")
    if not kinds:
        raise ConfigError("a body needs an interface.", hint="For example -i pin_a=rbe2.")
    body = reduce(
        read_model(args),
        method=method,
        interfaces=kinds,
        reference=args.reference[0] if len(args.reference) == 1 else args.reference,
        damping=damping,
        name=args.name or args.file.stem,
        certify=not args.no_certificate,
    )
    failed = failures(body.certificate) if body.certificate else ()
    return Answer(
        _data(body, args.output), _text(body, args.output), lambda: save(body, args.output), failed
    )


def _method(args: argparse.Namespace) -> "Method":
    from rom.reduction.enhanced import EnhancedCraigBampton
    from rom.reduction.free_interface import FreeFree, Herting, Rubin
    from rom.reduction.method import CraigBampton, Guyan

    if args.f_max:
        if args.method != METHODS[0]:
            raise ConfigError(f"--f-max belongs to {METHODS[0]}; give {args.method} a number -m.")
        return CraigBampton(f_max=args.f_max, tol=args.tol)
    if args.tol is not None:
        raise ConfigError("--tol needs the band --f-max.")
    if args.method == "guyan":
        if args.modes is not None:
            raise ConfigError("guyan keeps no modes: leave -m out.")
        return Guyan()
    made: dict[str, Any] = {
        "enhanced": EnhancedCraigBampton,
        "free-free": FreeFree,
        "herting": Herting,
        "rubin": Rubin,
    }
    return made.get(args.method, CraigBampton)(n_modes=20 if args.modes is None else args.modes)


def _damping(args: argparse.Namespace) -> "Rayleigh | ModalDamping | None":
    from rom.body.damping import ModalDamping, Rayleigh

    if args.damping_ratio is not None:
        return ModalDamping(args.damping_ratio)
    if args.rayleigh is None:
        return None
    try:
        alpha, beta = map(float, args.rayleigh.split(","))
    except ValueError:
        raise ConfigError(
            f"--rayleigh {args.rayleigh} is not two numbers, as in 0.1,1e-6."
        ) from None
    return Rayleigh(alpha, beta)


def _data(body: "FlexibleBody", output: Path) -> dict[str, Any]:
    return {
        "output": str(output),
        "name": body.name,
        "mass": body.mass,
        "n_modes": body.n_modes,
        "reference": body.reference,
        "interfaces": list(body.interface_names),
        "frequencies": (body.omega / (2 * pi)).tolist(),
        "certificate": None if body.certificate is None else report_data(body.certificate),
        "provenance": body.provenance,
    }


def _text(body: "FlexibleBody", output: Path) -> str:
    full = body.provenance["reduction"]["full dofs"]
    head = (
        f"{output}: body {body.name}, {body.mass:.6g} kg, {full} dofs reduced to "
        f"6 + {body.n_modes}, frame {body.reference}"
    )
    return head if body.certificate is None else f"{head}\n\n{body.certificate}"
