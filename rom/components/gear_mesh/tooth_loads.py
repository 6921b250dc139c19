"""Where teeth bear, and how much, during a motion."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from rom.arguments import typed
from rom.components.gear_mesh.gears.meshes import GEAR_MESHES_FAMILY
from rom.components.gear_mesh.gears.table import HEIGHT, LENGTH, LOAD, PLACE, SIDE
from rom.mbs.results.recomputed import at_instants
from rom.mbs.results.solution import Solution
from rom.model import Array
from rom.names import check_known


@dataclass(frozen=True)
class ToothLoads:
    """All slices of the teeth of one mesh that bear at one instant.

    Attributes:
        place: (n,) on the path of contact, from the tangent point on the pinion [m].
        height: (n,) over the middle of the face, along the axis of the pinion [m].
        length: (n,) of the line of contact in the slice [m].
        force: (n,) along the normal of the flanks [N].
        back: (n,) whether it is the back flanks that touch.
    """

    place: Array
    height: Array
    length: Array
    force: Array
    back: npt.NDArray[np.bool_]

    def across_face(self, width: float, n: int) -> Array:
        """(n,) force on strips of the face of a width [m] over its mean, from one end to the other.

        Ones mean that the load is even; the largest is the face load factor of gear standards, of
        forces, at this instant.
        """
        strip = np.clip(((self.height / width + 0.5) * n).astype(int), 0, n - 1)
        force = np.zeros(n)
        np.add.at(force, strip, self.force)
        return force / force.mean() if force.any() else force


@typed
def tooth_loads(solution: Solution, name: str) -> tuple[ToothLoads, ...]:
    """The teeth of a mesh at each instant of a motion; of an equilibrium after `rom.mbs.snapshot`.

    Raises:
        ConfigError: if there is no such mesh.
    """
    names = solution.packed.element_names.get(GEAR_MESHES_FAMILY, ())
    check_known(name, names, f"no gear mesh {name!r}; there are")
    k, table = names.index(name), solution.packed.elements[GEAR_MESHES_FAMILY]
    seen = []
    for _ in at_instants(solution):
        found = table.slices[k, : int(table.n_slices[k])].copy()
        place, height, length, force = found[:, [PLACE, HEIGHT, LENGTH, LOAD]].T
        seen.append(ToothLoads(place, height, length, force, found[:, SIDE] < 0))
    return tuple(seen)
