"""Bodies for MBDyn, OpenRadioss and Exudyn, read as these programs read them."""

import json
import runpy
import sys
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from benchmarks.peers.compare import PEER_FOLDER
from cases.command import ran
from cases.files.mbdyn import groups, numbers
from cases.mbs.mechanisms import nodal_body, random_body, random_nodes, simulate_quietly
from cases.mbs.particles import motion, particles
from cases.paths import ROOT
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.errors import ConfigError
from rom.io.matrices.matrix_files import read_matrix
from rom.io.programs.exudyn import arrays
from rom.io.programs.interface_form import interface_form
from rom.io.programs.superelements import write_radioss
from rom.model import Interface

pytestmark = pytest.mark.filterwarnings("ignore:the shapes of body")


def equations(found, q, qd, qdd, a, omega, domega):
    """Force, moment and elastic rows as the joint assembles them from the invariants."""
    r, cross = q.size, np.cross
    inv3, inv4 = (numbers(found[k], 3, r) for k in (14, 15))
    inv8 = numbers(found[16], 3, r, 3).transpose(1, 0, 2)  # by mode
    inv5 = numbers(found[17], 3, r, r).transpose(1, 0, 2)  # [j][:, k]
    inv9 = numbers(found[18], 3, r, r, 3).transpose(1, 2, 0, 3)
    mass, centre, about = float(found[12][0]), *np.split(numbers(found[12][1:], 4, 3), [1])
    centre = centre[0]
    J = about + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    i8, i8d = np.tensordot(q, inv8, 1), np.tensordot(qd, inv8, 1)
    i9, i9d = (np.einsum("j,k,jkab->ab", q, rate, inv9) for rate in (q, qd))
    i5, i5d = np.tensordot(q, inv5, 1), np.tensordot(qd, inv5, 1)
    J = J + i8 + i8.T - i9
    S = mass * centre + inv3 @ q
    force = mass * a - cross(S, domega) + cross(omega, cross(omega, S))
    force = force + inv3 @ qdd + 2 * cross(omega, inv3 @ qd)
    moment = cross(S, a) + J @ domega + cross(omega, J @ omega) + inv4 @ qdd + i5 @ qdd
    moment = moment + 2 * (i8d - i9d) @ omega
    M, K, D = (numbers(found[k], r, r) for k in (9, 10, 13))
    elastic = M @ qdd + D @ qd + K @ q + inv3.T @ a + (inv4 + i5).T @ domega + 2 * i5d.T @ omega
    for j in range(r):
        A = inv8[j].T - np.tensordot(q, inv9[j], 1)
        elastic[j] -= omega @ A @ omega
    return force, moment, elastic


def test_the_joint_moves_like_particles_to_second_order(tmp_path):
    nodes = random_nodes(np.random.default_rng(5), n=7, r=4)
    x, _, phi, _, _ = nodes
    body = nodal_body(*nodes, {"a": (x[0], phi[:, 0].T, np.zeros((3, 4)))})
    found = groups(rom.export(body, tmp_path / "b.fem"))
    for got, expected in zip(equations(found, *motion()), particles(nodes, *motion()), strict=True):
        assert_allclose(got, expected, atol=1e-11 * np.abs(expected).max())


def test_nodes_are_the_interfaces(tmp_path):
    body = random_body(np.random.default_rng(1))
    found = groups(rom.export(body, tmp_path / "b.fem"))
    assert found[1] == ["REV0", "2", "4", "0", "0", "0"]
    assert found[2] == ["a", "b"]
    points = np.array([numbers(found[k], 2) for k in (5, 6, 7)]).T
    assert_array_equal(points, [m.point for m in body.markers.values()])
    shapes = numbers(found[8], 4, 2, 6)
    for k, m in enumerate(body.markers.values()):
        assert_array_equal(shapes[:, k, :3].T, m.translation)
        assert_array_equal(shapes[:, k, 3:].T, m.rotation)
    assert 19 not in found and (tmp_path / "b.fem").read_text().count("NORMAL MODE SHAPE") == 4


def test_stiffening_stands_at_the_numbers_of_its_loads(tmp_path):
    body = random_body(np.random.default_rng(2), stiffened=True)
    words = groups(rom.export(body, tmp_path / "b.fem"))[19]
    assert int(words[0]) == 24
    table = numbers(words[1:], 24, 17)
    K = {int(row[0]): row[1:].reshape(4, 4) for row in table}
    for number, load in {
        1: "omega_x^2", 3: "omega_z^2", 4: "omega_x omega_y", 5: "omega_y omega_z",
        6: "omega_x omega_z", 7: "domega_x", 12: "a_z", 13: "a f_x", 16: "a m_x", 24: "b m_z",
    }.items():  # fmt: skip
        assert_array_equal(K[number], body.K_geo[load])


def test_what_mbdyn_cannot_take_is_named(tmp_path):
    body = random_body(np.random.default_rng(2))
    a, b = body.markers.values()
    for markers, says in (
        ({}, "4 shapes and 0 interfaces"),
        ({"a b": a, "a_b": b}, r"differ in more than blanks, got \['a_b', 'a_b'\]"),
    ):
        refuses(ConfigError, says, rom.export, replace(body, markers=markers), tmp_path / "b.fem")


KINDS = {"root": "rbe2", "tip": "rbe2", "side": "rbe2"}


@pytest.fixture(scope="module")
def model():
    model = block(size=(1.0, 0.3, 0.2), cells=(4, 2, 1))
    x, y, _ = model.points.T
    return with_interface(model, "side", (y > 0.29) & (np.abs(x - 0.5) < 0.26))


def with_interface(model, name, there, origin=None):
    """The model with some nodes of equal weight as one more interface."""
    nodes = np.flatnonzero(there)
    points, weights = model.points[nodes], np.eye(nodes.size) / nodes.size**2
    origin = points.mean(axis=0) if origin is None else origin
    more = {name: Interface(name, nodes, points, weights, origin)}
    return replace(model, interfaces=model.interfaces | more)


@pytest.fixture(scope="module")
def body(model):
    return rom.reduce(model, method=rom.Guyan(), interfaces=KINDS, certify=False)


def fixed_columns(text):
    """{name: (entries, 5) node, component, node, component, value} in the widths of the starter."""
    lines, found = text.splitlines(), {}
    assert lines[0].startswith("DMIG ")  # the first line is a header, or nothing is read
    for line in lines:
        if line.startswith("DMIG "):
            form, kind = int(line[24:32]), int(line[32:40])
            assert form == 6 and kind < 3
        elif line.startswith("DMIG*"):
            name, column = line[8:24].strip(), [int(line[24:40]), int(line[40:56])]
            assert name in ("KAAX", "MAAX")
        else:
            assert line[0] == "*"
            row = [int(line[8:24]), int(line[24:40]), float(line[40:56].replace("D", "E"))]
            found.setdefault(name, []).append([*column, *row])
    return {name: np.array(rows) for name, rows in found.items()}


def test_the_starter_finds_stiffness_and_mass_at_its_nodes(body, tmp_path):
    nodes = {"root": 70, "tip": 9, "side": 1234567890}
    path = write_radioss(body, tmp_path / "b.pch", nodes=nodes)
    form = interface_form(body)
    for name, A in (("KAAX", form.K), ("MAAX", form.M)):
        table = fixed_columns(path.read_text())[name]
        assert set(table[:, 0]) == set(nodes.values()) and set(table[:, 1]) == set(range(1, 7))
        start = {nodes[key]: 6 * k for k, key in enumerate(form.names)}
        i, j = ([start[n] + int(c) - 1 for n, c in table[:, s : s + 2]] for s in (0, 2))
        B = np.zeros_like(A)
        B[i, j] = B[j, i] = table[:, 4]
        assert_allclose(B, A, atol=1e-9 * np.abs(A).max())
    rigid = np.tile(np.eye(6, 3), (3, 1))
    assert_allclose(rigid.T @ B @ rigid, body.mass * np.eye(3), atol=1e-8 * body.mass)
    # labels count from one, and matrices come back
    path = rom.export(body, tmp_path / "b.pch")
    found = read_matrix((path, "KAAX"))
    assert_array_equal(found.dofs[::6, 0], [1, 2, 3])
    assert_allclose(found.A.toarray(), np.tril(form.K), rtol=1e-9)
    assert "BAAX" not in path.read_text() and "GRID" not in path.read_text()


def test_what_openradioss_does_not_take_is_named(model, body, tmp_path):
    path = tmp_path / "b.pch"
    modal = rom.reduce(model, method=rom.CraigBampton(2), interfaces=KINDS, certify=False)
    refuses(ConfigError, r"has 2 modes; .*reduce it with rom\.Guyan", rom.export, modal, path)
    two = {name: KINDS[name] for name in ("root", "tip")}
    with pytest.raises(ConfigError, match="has 2 interfaces"):
        rom.export(rom.reduce(model, method=rom.Guyan(), interfaces=two, certify=False), path)
    each = "must be one label for each interface"
    for words, more in ((each, {}), (each, {"side": 2}), ("1 to 10 digits", {"side": -3})):
        refuses(ConfigError, words, write_radioss, body, path, nodes={"root": 1, "tip": 2} | more)
    assert not path.exists()
    model = block(size=(1.0, 0.3, 0.2), cells=(4, 2, 1))
    between = 0.5 * (model.interfaces["root"].origin + model.interfaces["tip"].origin)
    line = with_interface(model, "middle", np.abs(model.points[:, 0] - 0.5) < 1e-9, between)
    kinds = dict.fromkeys(line.interfaces, "rbe2")
    body = rom.reduce(line, method=rom.Guyan(), interfaces=kinds, certify=False)
    refuses(ConfigError, "3 that do not lie on one line", rom.export, body, path)


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


def test_arrays_are_the_integrals_over_the_nodes(tmp_path):
    """The terms as Exudyn computes them from the matrices of all nodes."""
    x, Ms, phi, K, D = random_nodes(np.random.default_rng(8), n=5, r=3)
    M, Psi = np.kron(Ms, np.eye(3)), phi.transpose(1, 2, 0).reshape(15, 3)

    def tilde(columns):
        blocks = columns.reshape(5, 3, -1).swapaxes(1, 2)
        return np.block([[np.cross(v, np.eye(3)).T for v in row] for row in blocks])

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
    module = runpy.run_path(str(rom.export(body, tmp_path / "rod.py")))
    assert module["INTERFACES"] == ['it"s']
    for name, A in expected.items():
        assert_allclose(module["ARRAYS"][name], A, atol=1e-12, err_msg=name)
    assert set(module["ARRAYS"]) == set(arrays(body))
    # six nodes move and turn like their interface
    found, turn = arrays(body), markers['it"s'][2]
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
    tip = simulate_quietly(mech, t_end=0.2, dt=5e-4).position("rod", "tip")
    rom.export(body, tmp_path / "rod.py")
    done = ran(PEER, "-c", SCRIPT, tmp_path, json.dumps(root.tolist()), timeout=600)
    assert done.returncode == 0, done.stderr
    theirs = np.array(json.loads(done.stdout.splitlines()[-1]))
    # what is left are the two integrators
    fallen = np.linalg.norm(tip[-1] - tip[0])
    assert fallen > 0.1
    assert_allclose(tip[-1], theirs, atol=2e-6 * fallen, rtol=0)


def test_shapes_that_move_the_mass_centre_are_told_and_names_never_become_code(tmp_path):
    body = nodal_body(*random_nodes(np.random.default_rng(8), n=5, r=2), name='"""+exit(3)+"""')
    with pytest.warns(rom.errors.RomWarning, match="move its mass centre"):
        path = rom.export(body, tmp_path / "2 rods.py")
    assert ran(sys.executable, path).returncode == 0
