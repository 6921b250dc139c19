"""Run-up of a rotor of geometrically exact beams by Exudyn; a script without rom.

``python beams.py rotor.json`` prints {"seconds", "tips", "version"}: processor time of the time
integration alone, and the (k, blades, 3) positions of the tips after each step that was saved.

``rotor.json`` holds "blades", lists of {"nodes": (n + 1, 7) positions and quaternions, first axis
along the blade; "length", "stiffness", "damping", "inertia", "mass": of the n elements, per
length}, and "final", "rise", "t_end", "steps", "samples", "rho_inf". The roots turn about the first
axis of the world, whose origin is the hub, by the angle of `angle`.
"""

import json
import sys
from itertools import pairwise
from math import pi, sin
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

sys.exudynFast = True  # type: ignore[attr-defined]  # the variant without range checks
import exudyn as exu  # noqa: E402
from exudyn import itemInterface as item  # noqa: E402


def angle(t: float, final: float, rise: float) -> float:
    """Angle of the rotor [rad]: the speed grows without a jerk."""
    if t >= rise:
        return final * (t - rise / 2)
    k = 2 * pi / rise
    return final * (t * t / (2 * rise) - sin(k * t / 2) ** 2 / (pi * k))


def section(one: dict[str, Any], k: int) -> Any:
    """Section of element k."""
    section = exu.BeamSection()
    section.stiffnessMatrix = np.diag(one["stiffness"][k])
    section.dampingMatrix = np.diag(one["damping"][k])
    section.inertia = np.diag(one["inertia"][k])
    section.massPerLength = one["mass"][k]
    return section


class Rotor:
    """The rotor in Exudyn."""

    def __init__(self, described: dict[str, Any]):
        self.described = described
        self.container = exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        hub = self.hub()
        self.tips = [self.blade(hub, one) for one in described["blades"]]
        self.mbs.Assemble()

    def hub(self) -> Any:
        """A body that turns as prescribed."""
        inertia = exu.rigidBodyUtilities.RigidBodyInertia(1.0, np.eye(3))
        node, body = self.mbs.CreateRigidBody(
            inertia=inertia, nodeType=exu.NodeType.RotationRxyz, returnDict=True
        ).values()
        ground = self.mbs.AddNode(item.NodePointGround())
        fixed = self.mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=ground, coordinate=0))
        final, rise = self.described["final"], self.described["rise"]

        def turned(_mbs: Any, t: float, _item: Any, _offset: float) -> float:
            return angle(t, final, rise)

        for k in range(6):
            own = self.mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=k))
            options = {"offsetUserFunction": turned} if k == 3 else {}
            self.mbs.AddObject(item.CoordinateConstraint(markerNumbers=[fixed, own], **options))
        return body

    def blade(self, hub: Any, one: dict[str, Any]) -> Any:
        """A blade on the hub; the sensor of its tip."""
        nodes = [
            self.mbs.AddNode(item.NodeRigidBodyEP(referenceCoordinates=node))
            for node in one["nodes"]
        ]
        for k, pair in enumerate(pairwise(nodes)):
            self.mbs.AddObject(
                item.ObjectBeamGeometricallyExact(
                    nodeNumbers=list(pair), length=one["length"][k], sectionData=section(one, k)
                )
            )
        root = one["nodes"][0]
        A = exu.rigidBodyUtilities.EulerParameters2RotationMatrix(root[3:])
        place = exu.HT(rotation=A, translation=root[:3])
        on_hub = self.mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=hub, localHT=place))
        on_blade = self.mbs.AddMarker(item.MarkerNodeRigid(nodeNumber=nodes[0]))
        self.mbs.AddObject(item.GenericJoint(markerNumbers=[on_hub, on_blade]))
        return self.mbs.AddSensor(
            item.SensorNode(
                nodeNumber=nodes[-1],
                outputVariableType=exu.OutputVariableType.Position,
                storeInternal=True,
            )
        )

    def run(self) -> tuple[float, list[Any]]:
        """Processor time [s], and the (k, blades, 3) positions of the tips."""
        settings, run = exu.SimulationSettings(), self.described
        integration = settings.timeIntegration
        integration.numberOfSteps, integration.endTime = run["steps"], run["t_end"]
        integration.generalizedAlpha.spectralRadius = run["rho_inf"]
        integration.newton.useModifiedNewton = True
        integration.newton.newtonResidualMode = 1  # forces at rest are nothing but round-off
        settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
        settings.solution.file.write = False
        settings.solution.sensors.writePeriod = run["t_end"] / run["samples"]
        integration.verboseMode = 0
        start = process_time()
        self.mbs.SolveDynamic(settings)
        seconds = process_time() - start
        tips = [self.mbs.GetSensorStoredData(tip)[:, 1:] for tip in self.tips]
        return seconds, np.array(tips).transpose(1, 0, 2).tolist()


if __name__ == "__main__":
    seconds, tips = Rotor(json.loads(Path(sys.argv[1]).read_text())).run()
    found = {"seconds": seconds, "tips": tips, "version": exu.__version__}
    sys.stdout.write(json.dumps(found) + "\n")
