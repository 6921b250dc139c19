"""The module for Exudyn: its arrays from nodes, and the same motion where Exudyn is installed."""

import json
import subprocess
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from benchmarks.peers.compare import PEER_FOLDER
from cases.mbs.mechanisms import nodal_body, random_nodes, simulate_quietly
from cases.paths import ROOT
from cases.solid import block, reduced
from rom.io.programs.exudyn import arrays

PEER = ROOT / PEER_FOLDER / "bin" / "python"
SCRIPT = """
import sys, json
sys.path.insert(0, sys.argv[1])
import exudyn as exu
from exudyn import itemInterface as item
import rod
mbs = exu.SystemContainer().AddSystem()
body = rod.add(mbs, gravity=[0, 0, -9.81])
ground = mbs.AddObject(item.ObjectGround(referencePosition=json.loads(sys.argv[2])))
there = mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=ground))
here = rod.marker(mbs, body, "root")
mbs.AddObject(item.GenericJoint(markerNumbers=[there, here], constrainedAxes=[1, 1, 1, 1, 0, 1]))
tip = rod.marker(mbs, body, "tip")
sensor = mbs.AddSensor(item.SensorMarker(
    markerNumber=tip, outputVariableType=exu.OutputVariableType.Position, writeToFile=False))
mbs.Assemble()
s = exu.SimulationSettings()
s.timeIntegration.endTime, s.timeIntegration.numberOfSteps = 0.2, 400
s.timeIntegration.generalizedAlpha.spectralRadius = 0.9
s.timeIntegration.verboseMode, s.solutionSettings.writeSolutionToFile = 0, False
mbs.SolveDynamic(s)
print(json.dumps(list(mbs.GetSensorValues(sensor))))
"""


pytestmark = pytest.mark.filterwarnings("ignore:the shapes of body")


def loaded(path):
    space = {}
    exec(compile(path.read_text(), str(path), "exec"), space)
    return space


def test_arrays_are_the_integrals_over_the_nodes(tmp_path):
    """The terms as Exudyn computes them from the matrices of all nodes."""
    x, Ms, phi, K, D = random_nodes(np.random.default_rng(8), n=5, r=3)
    M, Psi = np.kron(Ms, np.eye(3)), phi.transpose(1, 2, 0).reshape(15, 3)

    def tilde(columns):
        blocks = columns.reshape(5, 3, -1)
        out = [[np.cross(blocks[n, :, k], np.eye(3)).T for k in range(blocks.shape[2])]
               for n in range(5)]  # fmt: skip
        return np.block(out)

    v = np.array([1.0, 2.0, 3.0])
    assert_allclose(tilde(x.ravel())[3:6] @ v, np.cross(x[1], v))
    ones, xt, pt = np.tile(np.eye(3), (5, 1)), tilde(x.ravel()), tilde(Psi)
    expected = {
        "inertia": xt.T @ M @ xt, "mPhitTPsi": ones.T @ M @ Psi, "mPhitTPsiTilde": ones.T @ M @ pt,
        "mXRefTildePsi": xt.T @ M @ Psi, "mXRefTildePsiTilde": xt.T @ M @ pt,
        "mPsiTildePsi": pt.T @ M @ Psi, "mPsiTildePsiTilde": pt.T @ M @ pt,
        "M": Psi.T @ M @ Psi, "K": K, "D": D, "centerOfMass": Ms.sum(0) @ x / Ms.sum(),
    }  # fmt: skip
    markers = {'it"s': (x[0], phi[:, 0].T, np.random.default_rng(2).normal(size=(3, 3)))}
    body = nodal_body(x, Ms, phi, K, D, markers)
    module = loaded(rom.export(body, tmp_path / "rod.py"))
    assert module["INTERFACES"] == ['it"s']
    for name, A in expected.items():
        assert_allclose(module["ARRAYS"][name], A, atol=1e-12, err_msg=name)
    assert set(module["ARRAYS"]) == set(arrays(body))


def test_six_nodes_move_and_turn_like_their_interface():
    x, Ms, phi, K, D = random_nodes(np.random.default_rng(8), n=5, r=3)
    turn = np.random.default_rng(2).normal(size=(3, 3))
    body = nodal_body(x, Ms, phi, K, D, {"a": (x[0], phi[:, 0].T, turn)})
    found = arrays(body)
    X, q = found["referencePositions"].reshape(-1, 3), np.array([0.3, -0.2, 0.5])
    u = (found["modeBasis"] @ q).reshape(-1, 3)
    assert_allclose(X.mean(axis=0), x[0], atol=1e-14)
    assert_allclose(u - phi[:, 0].T @ q, np.cross(turn @ q, X - x[0]), atol=1e-14)


@pytest.mark.once
@pytest.mark.skipif(not PEER.exists(), reason="Exudyn is not installed beside")
def test_exudyn_moves_the_body_as_we_do(tmp_path):
    """A soft pendulum, its tip bending by several centimetres, after 0.2 s."""
    rubber = rom.Material(E=2e6, nu=0.3, rho=1100.0)
    soft = block(cells=(4, 1, 1), material=rubber)
    body = reduced(2, soft, reference="mean-axis", damping=rom.Rayleigh(0.0, 2e-3))
    assert not body.K_geo
    mech = rom.Mechanism(gravity=(0.0, 0.0, -9.81))
    rod = mech.add_flexible("rod", body)
    root = rod.point(rod.marker("root"))
    mech.revolute("hinge", mech.ground.marker(root), rod.marker("root"), axis=(0, 1, 0))
    sol = simulate_quietly(mech, t_end=0.2, dt=5e-4)
    rom.export(body, tmp_path / "rod.py")
    done = subprocess.run(
        [PEER, "-c", SCRIPT, str(tmp_path), json.dumps(root.tolist())],
        capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    theirs = np.array(json.loads(done.stdout.splitlines()[-1]))
    # what is left are the two integrators
    fallen = np.linalg.norm(sol.position("rod", "tip")[-1] - sol.position("rod", "tip")[0])
    bent = np.abs(sol.elastic("rod")).max()
    assert fallen > 0.1 and bent > 0
    assert_allclose(sol.position("rod", "tip")[-1], theirs, atol=2e-6 * fallen, rtol=0)


def test_shapes_that_move_the_mass_centre_are_told(tmp_path):
    body = nodal_body(*random_nodes(np.random.default_rng(8), n=5, r=2))
    with pytest.warns(rom.errors.RomWarning, match="move its mass centre"):
        rom.export(body, tmp_path / "rod.py")


def test_the_module_is_not_run_by_its_name(tmp_path):
    """Names of bodies and interfaces are data: they never become code."""
    body = nodal_body(*random_nodes(np.random.default_rng(8), n=5, r=2), name='"""+exit(3)+"""')
    path = rom.export(body, tmp_path / "2 rods.py")
    done = subprocess.run([sys.executable, str(path)], timeout=60, check=False)
    assert done.returncode == 0
