"""Statics and modes of a bent cantilever of geometrically exact beams by Exudyn; without rom.

``python cantilever.py rod.json`` prints {"equilibrium", "modes", "tip", "frequencies", "version"}:
processor times of the static solution and of ten modes about it, the position of the tip [m] and
the frequencies [Hz].

``rod.json`` holds "length", "segments", "force" (of the tip, across the rod), and per length, about
axes of which the first is along the rod: "stiffness" (6), "inertia" (3), "mass". The rod is along
the first axis of the world.
"""

import json
import sys
from itertools import pairwise
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

sys.exudynFast = True  # type: ignore[attr-defined]  # the variant without range checks
import exudyn as exu  # noqa: E402
from exudyn import itemInterface as item  # noqa: E402

N_MODES = 10
CLAMPED_COORDINATES = [0, 1, 2, 3, 4, 5]  # of the first node


class Cantilever:
    """The rod in Exudyn; three angles per node, so that there is no constraint but the clamp."""

    def __init__(self, described: dict[str, Any]):
        self.container = exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        n = described["segments"]
        self.nodes = [
            self.mbs.AddNode(item.NodeRigidBodyRxyz(referenceCoordinates=[x, 0, 0, 0, 0, 0]))
            for x in np.linspace(0.0, described["length"], n + 1)
        ]
        for pair in pairwise(self.nodes):
            self.mbs.AddObject(
                item.ObjectBeamGeometricallyExact(
                    nodeNumbers=list(pair),
                    length=described["length"] / n,
                    sectionData=section(described),
                )
            )
        self.clamp()
        tip = self.mbs.AddMarker(item.MarkerNodePosition(nodeNumber=self.nodes[-1]))
        self.mbs.AddLoad(item.Force(markerNumber=tip, loadVector=described["force"]))
        self.mbs.Assemble()

    def clamp(self) -> None:
        """Hold the first node."""
        ground = self.mbs.AddNode(item.NodePointGround())
        fixed = self.mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
        for k in CLAMPED_COORDINATES:
            own = self.mbs.AddMarker(
                item.MarkerNodeCoordinate(nodeNumber=self.nodes[0], coordinate=k)
            )
            self.mbs.AddObject(item.CoordinateConstraint(markerNumbers=[fixed, own]))

    def rest(self) -> tuple[float, list[float]]:
        """Processor time [s] of the equilibrium, and the tip [m]."""
        settings = self.settings()
        settings.staticSolver.numberOfLoadSteps = 1
        start = process_time()
        self.mbs.SolveStatic(settings, updateInitialValues=True)
        seconds = process_time() - start
        position = exu.OutputVariableType.Position
        return seconds, self.mbs.GetNodeOutput(self.nodes[-1], position).tolist()

    def modes(self) -> tuple[float, list[float]]:
        """Processor time [s] of the modes about it, and their frequencies [Hz]."""
        start = process_time()
        f, _ = self.mbs.ComputeODE2Eigenvalues(
            self.settings(),
            useSparseSolver=True,
            numberOfEigenvalues=N_MODES,
            constrainedCoordinates=CLAMPED_COORDINATES,
            ignoreAlgebraicEquations=True,  # the clamp again
            convert2Frequencies=True,
        )
        return process_time() - start, sorted(f.tolist())

    def settings(self) -> Any:
        """Options of the solvers."""
        settings = exu.SimulationSettings()
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        settings.solution.file.write = False
        settings.staticSolver.newton.residualMode = 1  # forces at rest are round-off
        settings.staticSolver.verboseMode = 0
        return settings


def section(described: dict[str, Any]) -> Any:
    """Section of each element."""
    section = exu.BeamSection()
    section.stiffnessMatrix = np.diag(described["stiffness"])
    section.inertia = np.diag(described["inertia"])
    section.massPerLength = described["mass"]
    return section


if __name__ == "__main__":
    rod = Cantilever(json.loads(Path(sys.argv[1]).read_text()))
    equilibrium, tip = rod.rest()
    modes, frequencies = rod.modes()
    found = {"equilibrium": equilibrium, "modes": modes, "tip": tip, "frequencies": frequencies}
    sys.stdout.write(json.dumps(found | {"version": exu.__version__}) + "\n")
