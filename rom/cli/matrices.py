"""The model that options ask for, of a geometry or of matrices of another program."""

import argparse
from pathlib import Path

import rom
from rom.cli.options import (
    assignment,
    material,
    option,
    reading,
    require,
    solid_options,
    unique,
    verb_parsers,
)
from rom.config.component import quickly_solved, source
from rom.errors import ConfigError
from rom.model import FEModel, Index
from rom.names import is_whole, named

GEOMETRY_OPTIONS = (
    "E nu rho degree solver parameter face scale order trust time_limit memory_limit".split()
)
MATRIX_OPTIONS = "nodes set damping_matrix dofs modal hold_drilling".split()
MOST_NODES = 10_000_000  # in a range


def add_matrices(parser: argparse.ArgumentParser) -> None:
    """Mass and nodes; the file of the verb is then the stiffness."""
    group = parser.add_argument_group(
        "matrices of another program",
        "FILE is then the stiffness: .mtx, .mm, .sti, .op4, .bdf, .dat, .pch or .dmig, with :NAME "
        "behind where it holds several; interfaces are node sets of the .inp, or --set",
    )
    option(group, "--mass FILE[:NAME]", "mass matrix", str)
    option(group, "--damping-matrix FILE[:NAME]", "damping, where there is one", str)
    option(group, "--nodes FILE", ".inp, .bdf, .dat, .pch, .asm, .dmig or .csv", Path)
    about = "what rows without labels are: .csv, .mapping, or .pch and .asm with EXTRN"
    option(group, "--dofs FILE", about, Path)
    about = "labels whose rows are amplitudes of modes, e.g. 1001-1020"
    option(group, "--modal LABELS", about, str)
    about = "leave out rotations without stiffness and mass"
    option(group, "--hold-drilling", about)
    about = "nodes of an interface, e.g. pin=11-14,20; may be repeated"
    option(group, "--set NAME=LABELS", about, assignment)


def read_model(args: argparse.Namespace) -> FEModel:
    """The model that options ask for, of a geometry or of matrices."""
    if args.mass is not None:
        return read_matrices(args)
    given = [name for name in MATRIX_OPTIONS if getattr(args, name)]
    if given:
        raise ConfigError(f"{_option(given[0])} needs --mass FILE: it is for matrices.")
    hint = "Or --material steel; for matrices of another program --mass and --nodes instead."
    require(solid_options(args), hint)
    numbers = {"material": material(args), "degree": args.degree, "solver": args.solver}
    how = numbers | reading(args)  # refused before dolfinx is loaded
    from rom.fe.elasticity import model

    return model(args.file, **how)


def read_matrices(args: argparse.Namespace) -> FEModel:
    """The model of the matrices the options name."""
    parser = verb_parsers(args.parser)[args.verb]
    odd = [name for name in GEOMETRY_OPTIONS if getattr(args, name) != parser.get_default(name)]
    if odd:
        fault = f"{_option(odd[0])} is for geometries, and --mass for matrices"
        raise ConfigError(f"{fault}; give one of them.")
    if args.nodes is None:
        raise ConfigError("--mass needs --nodes, the file with the places of the nodes.")
    held = [word.partition(":")[0] for word in getattr(args, "fixed", ())]
    names = [*unique(args.interface, "-i"), *held]
    model = rom.read_model(
        source(str(args.file)),
        source(args.mass),
        nodes=args.nodes,
        interfaces=_sets(args, list(dict.fromkeys(names))),
        D=source(args.damping_matrix) if args.damping_matrix else None,
        dofs=args.dofs,
        units=args.units,
        modal=labels("--modal", args.modal) if args.modal else (),
        hold_drilling=args.hold_drilling,
    )
    return quickly_solved(model)


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _sets(args: argparse.Namespace, names: list[str]) -> dict[str, list[int] | Index]:
    found = unique([(name, labels("--set", text)) for name, text in args.set], "--set")
    if unused := sorted(set(found) - set(names)):
        raise ConfigError(f"--set {', '.join(unused)} is no interface; name it by -i or --fixed.")
    remaining = tuple(name for name in names if name not in found)
    if remaining and args.nodes.suffix.lower() != ".inp":
        what = f"which nodes are the interface {named(remaining)}? {args.nodes} has no node sets"
        raise ConfigError(f"{what}; for example --set {remaining[0]}=11-14,20.")
    return found | (rom.io.read_node_sets(args.nodes, remaining) if remaining else {})


def labels(option: str, text: str) -> list[int]:
    """Labels of nodes of an option, from 11-14,20."""
    found: list[int] = []
    for part in text.split(","):
        first, dash, last = part.strip().partition("-")
        last = last if dash else first
        if not (is_whole(first) and is_whole(last) and int(first) <= int(last)):
            raise ConfigError(
                f"{option}: {part!r} must be a label or a range of labels as in 11-14."
            )
        if int(last) - int(first) > MOST_NODES:
            raise ConfigError(f"{option}: {part} must have at most {MOST_NODES} nodes.")
        found += range(int(first), int(last) + 1)
    return found
