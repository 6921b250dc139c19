"""Wheels on springs: bearings that push back alike in all directions across the axis."""

from dataclasses import replace

import numpy as np
from scipy.sparse import csr_matrix, kron

from rom.arguments import typed
from rom.components.wheels.sector import CyclicSector
from rom.errors import ConfigError, InterfaceError
from rom.model import Interface


@typed
def supported_sector(
    sector: CyclicSector, face: Interface, *, across: float = 0.0, along: float = 0.0
) -> CyclicSector:
    """The sector of a wheel or rotor that rests on springs, spread evenly over a face of it.

    Springs that are the same for all directions across the axis look the same from axes that turn
    with the wheel: this is an isotropic bearing. Give a rotor its matrices of rotation before.

    Args:
        sector: with or without matrices of rotation.
        face: interface of the model the sector was made from, where it rests.
        across: stiffness of the whole wheel's support across the axis [N/m].
        along: along the axis [N/m].

    Raises:
        ConfigError: if the stiffness is not positive in any direction, or negative in one.
        InterfaceError: if the sector has no such nodes.

    Source:
        Isotropic bearings seen from the rotor: Friswell, Penny, Garvey and Lees, Dynamics of
        Rotating Machines (2010); see docs/theory/rotating_solids.md.
    """
    if not (np.isfinite([across, along]).all() and min(across, along) >= 0 < across + along):
        raise ConfigError(
            f"springs of {across:g} N/m across and {along:g} N/m along the axis hold nothing; "
            "one must be positive, none negative."
        )
    if sector.points is None or face.dofs.max() >= sector.n:
        raise InterfaceError(
            f"the sector does not have the nodes of {face.name!r}.",
            hint="Give an interface of the model that the sector was made from.",
        )
    e = sector.axis
    each = across * (np.eye(3) - np.outer(e, e)) + along * np.outer(e, e)
    share = kron(face.surface_mass / face.area, each / sector.n_sectors, format="coo")
    at = face.dofs
    K = csr_matrix((share.data, (at[share.row], at[share.col])), shape=sector.K.shape)
    return replace(sector, K=csr_matrix(sector.K + K), motions=None, sprung=True)
