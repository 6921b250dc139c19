"""Natural frequencies of the full finite element model, free or held at interfaces."""

import argparse

import rom
from rom.cli.answer import Answer, table
from rom.cli.described import component, described, keyed
from rom.cli.matrices import add_matrices, read_model
from rom.cli.options import (
    add_geometry,
    add_interfaces,
    add_solid,
    assignment,
    option,
    typed_number,
    unique,
)

SUMMARY = "natural frequencies of the full model"
EXAMPLES = """\
  rom modes meshes/beam.geo --E 210e9 --nu 0.3 --rho 7850 -n 12
  rom modes meshes/beam.geo --E 210e9 --nu 0.3 --rho 7850 -n 6 --fixed root
  mpirun -n 2 rom modes part.msh --E 70e9 --nu 0.33 --rho 2700 --json
  rom modes part.step --face foot=normal:0,0,-1 --fixed foot --E 70e9 --nu 0.33 --rho 2700
  rom modes meshes/beam.geo --E 210e9 --nu 0.3 --rho 7850 --fixed root,tip:yz   # slides along x
  rom modes meshes/connecting_rod.toml --fixed pin_a   # interfaces as in its body
  rom modes rod.sti --mass rod.mas --nodes rod.inp --fixed pin_a
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    add_geometry(parser)
    add_solid(parser)
    keyed(parser, "--degree", "--solver")
    add_interfaces(parser)
    add_matrices(parser)
    keyed(parser, "-n --number", "--fixed NAME,...")
    about = (
        "stiffness from an interface to the ground, three translations [N/m] or those and three "
        "rotations [N m/rad]"
    )
    option(parser, "--spring NAME=KX,KY,KZ,...", about, assignment)


def run(args: argparse.Namespace) -> Answer:
    """Assemble and solve."""
    if described(args):
        part = component(args)
        kinds, model = part.kinds, part.model()
        n, fixed = (part.values["modes"][key] for key in ("number", "fixed"))
        springs = [assignment(word) for word in part.values["modes"]["spring"]]
    else:
        kinds, model = unique(args.interface, "-i"), read_model(args)
        n, fixed, springs = args.number, args.fixed, args.spring
    stiffness = {
        name: [typed_number("--spring", part) for part in text.split(",")]
        for name, text in unique(springs, "--spring").items()
    }
    found = rom.modes(model, n, fixed=fixed, springs=stiffness, interfaces=kinds or None)
    data = {
        "file": str(args.file),
        "n_dofs": model.n_dofs,
        "mass": model.mass(),
        "fixed": list(fixed),
        "frequencies": found.frequencies.tolist(),
        "residual": found.residual.tolist(),
    }
    rows = [
        (str(k + 1), f"{f:.6g}", f"{r:.1e}")
        for k, (f, r) in enumerate(zip(found.frequencies, found.residual, strict=True))
    ]
    held = [f"held at {', '.join(fixed)}"] * bool(fixed)
    support = " and ".join([*held, *(f"on a spring at {name}" for name in stiffness)]) or "free"
    head = f"{args.file}: {model.n_dofs} dofs, {data['mass']:.6g} kg, {support}"
    return Answer(data, head + "\n\n" + table(("mode", "frequency [Hz]", "residual"), rows))
