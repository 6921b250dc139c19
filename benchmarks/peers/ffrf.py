"""Motion of mechanisms by Exudyn's ``ObjectFFRFreducedOrder``; a script without rom.

``python ffrf.py body.rom.npz matrices.npz runs.json`` prints a list with {"seconds", "positions",
"version"} for each run: processor time of the time integration alone, and the (k + 1, 3) path of
the point watched at the start and after each k-th of the duration.

With a number of processes behind it, all runs are one variation of parameters on these, and the
answer is {"seconds", "least"}: time by the clock, and the least x of each path.

The body file has all nodes of the mesh as its surface, so that the modes are known everywhere;
``matrices.npz`` is that of ``craig_bampton.py`` with the weights of the interface nodes as
``weights_0``, ... and their names as ``names``. ``runs.json`` is a list of {"mechanism", "t_end",
"steps", "samples", "rho_inf", "times"}; for the mechanisms see ``mechanisms.py``. The fastest of
so many times counts.
"""

import json
import sys
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np
from craig_bampton import read

sys.exudynFast = True  # type: ignore[attr-defined]  # the variant without range checks
import exudyn as exu  # noqa: E402
from exudyn import itemInterface as item  # noqa: E402
from exudyn.FEM import FEMinterface, ObjectFFRFreducedOrderInterface  # noqa: E402
from exudyn.processing import ParameterVariation  # noqa: E402

FREE_AXES = {
    "revolute": [1, 1, 1, 1, 1, 0],
    "point_on_line": [1, 1, 0, 0, 0, 0],
}  # about or along z
SLIDER_AXES = [0, 1, 1, 1, 1, 1]  # along x
MAX_DENSE_UNKNOWNS = 150  # a dense factor is the faster one up to here


class Body:
    """The flexible body, and the nodes and weights of its interfaces by name."""

    def __init__(self, body_file: str, matrices: str):
        K, M, points, interfaces = read(matrices)
        data, body = np.load(matrices), np.load(body_file)
        fem = FEMinterface()
        fem.nodes = {"Position": points}
        fem.massMatrix, fem.stiffnessMatrix = M, K
        fem.modeBasis = {"matrix": body["surface/shape"], "type": "NormalModes"}
        self.ffrf = ObjectFFRFreducedOrderInterface(fem)
        self.n = self.ffrf.nModes
        self.faces = {
            str(name): (nodes.tolist(), data[f"weights_{k}"].tolist())
            for k, (name, nodes) in enumerate(zip(data["names"], interfaces, strict=True))
        }


class Model:
    """A mechanism in Exudyn."""

    def __init__(self, described: dict[str, Any], body: Body):
        self.container = exu.SystemContainer()
        self.mbs, self.body, self.described = self.container.AddSystem(), body, described
        self.ground = self.mbs.AddObject(item.ObjectGround())
        self.objects = {name: self.add(name) for name in described["bodies"]}
        for joint in described["joints"]:
            self.join(*joint)
        self.watched = self.mbs.AddSensor(
            item.SensorMarker(
                markerNumber=self.marker(*described["watch"], turns=False),
                outputVariableType=exu.OutputVariableType.Position,
                storeInternal=True,
            )
        )
        self.mbs.Assemble()

    def add(self, name: str) -> Any:
        """The object number of a body."""
        data, gravity = self.described["bodies"][name], self.described["gravity"]
        if "mass" not in data:
            return self.body.ffrf.AddObjectFFRFreducedOrder(
                self.mbs,
                positionRef=data["at"],
                initialVelocity=data["velocity"],
                initialAngularVelocity=data["omega"],
                rotationMatrixRef=np.eye(3),
                gravity=gravity,
            )["oFFRFreducedOrder"]
        inertia = exu.rigidBodyUtilities.RigidBodyInertia(data["mass"], np.diag(data["inertia"]))
        return self.mbs.CreateRigidBody(
            inertia=inertia,
            referencePosition=data["at"],
            initialVelocity=data["velocity"],
            initialAngularVelocity=data["omega"],
            gravity=gravity,
        )

    def marker(self, name: str, place: Any, *, turns: bool) -> Any:
        """The marker of a joint; one that does not turn costs less."""
        if name == "ground":
            return self.mbs.AddMarker(
                item.MarkerBodyRigid(bodyNumber=self.ground, localPosition=place)
            )
        data = self.described["bodies"][name]
        if "mass" in data:
            point = data["markers"][place]
            return self.mbs.AddMarker(
                item.MarkerBodyRigid(bodyNumber=self.objects[name], localPosition=point)
            )
        nodes, weights = self.body.faces[place]
        kind = item.MarkerSuperElementRigid if turns else item.MarkerSuperElementPosition
        number = self.objects[name]
        return self.mbs.AddMarker(
            kind(bodyNumber=number, meshNodeNumbers=nodes, weightingFactors=weights)
        )

    def join(self, _name: str, kind: str, i: Any, j: Any, axis: Any) -> None:
        """Add a joint."""
        if kind == "spherical":
            markers = [self.marker(*end, turns=False) for end in (i, j)]
            self.mbs.AddObject(item.SphericalJoint(markerNumbers=markers))
            return
        markers = [self.marker(*end, turns=True) for end in (i, j)]
        along = SLIDER_AXES if kind == "prismatic" else FREE_AXES[kind]
        assert axis == ([1, 0, 0] if kind == "prismatic" else [0, 0, 1]), axis
        self.mbs.AddObject(item.GenericJoint(markerNumbers=markers, constrainedAxes=along))

    def move(self, run: dict[str, Any]) -> dict[str, Any]:
        """Integrate and say how long it took."""
        settings = exu.SimulationSettings()
        time = settings.timeIntegration
        time.numberOfSteps, time.endTime = run["steps"], run["t_end"]
        time.verboseMode = 0
        time.generalizedAlpha.spectralRadius = run["rho_inf"]
        time.generalizedAlpha.computeInitialAccelerations = True
        time.newton.useModifiedNewton = True
        time.newton.relativeTolerance = 1e-9
        settings.solutionSettings.writeSolutionToFile = False
        settings.solutionSettings.sensorsWritePeriod = run["t_end"] / run["samples"]
        settings.displayStatistics = settings.displayComputationTime = False
        n = self.mbs.systemData.ODE2Size() + self.mbs.systemData.AEsize()
        kind = exu.LinearSolverType
        settings.linearSolver.solverType = (
            kind.EXUdense if n < MAX_DENSE_UNKNOWNS else kind.EigenSparse
        )
        start = process_time()
        self.mbs.SolveDynamic(settings)
        seconds = process_time() - start
        positions = self.mbs.GetSensorStoredData(self.watched)[:, 1:]
        return {
            "seconds": seconds,
            "positions": positions.tolist(),
            "version": exu.__version__,
        }


def main(body_file: str, matrices: str, runs: str) -> None:
    """All runs of a body."""
    body = Body(body_file, matrices)
    found = []
    for run in json.loads(Path(runs).read_text()):
        again = [Model(run["mechanism"], body).move(run) for _ in range(run["times"])]
        found.append(min(again, key=lambda moved: moved["seconds"]))
    sys.stdout.write(json.dumps(found) + "\n")


def vary(body_file: str, matrices: str, runs: str, workers: str) -> None:
    """All runs by the variation of parameters on so many processes: least x of each, and time."""
    globals().update(body=Body(body_file, matrices), runs=json.loads(Path(runs).read_text()))
    start = perf_counter()
    _, least = ParameterVariation(
        parameterFunction=least_of,
        parameters={"run": list(range(len(globals()["runs"])))},
        useMultiProcessing=True,
        numberOfThreads=int(workers),
        showProgress=False,
    )
    seconds = perf_counter() - start
    sys.stdout.write(json.dumps({"seconds": seconds, "least": least}) + "\n")


def least_of(parameters: dict[str, Any]) -> float:
    """Least x of the point watched in a run."""
    run = globals()["runs"][int(parameters["run"])]
    positions = Model(run["mechanism"], globals()["body"]).move(run)["positions"]
    return min(x for x, _, _ in positions)


if __name__ == "__main__":
    (vary if len(sys.argv) > 4 else main)(*sys.argv[1:])
