"""The model that options ask for, of a geometry or of matrices."""

import argparse
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rom.model import FEModel
from rom.cli.options import material, reading


def read_model(args: argparse.Namespace) -> "FEModel":
    """The finite element model the options ask for."""
    from rom.cli.matrices import check_geometry, read_matrices

    if args.mass is not None:
        return read_matrices(args)
    check_geometry(args)
    numbers = {"material": material(args), "degree": args.degree, "solver": args.solver}
    how = numbers | reading(args)  # refused before dolfinx is loaded
    from rom.fe.elasticity import model

    return model(args.file, **how)
