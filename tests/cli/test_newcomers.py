"""What people write who have not read the manual: names for things, units in texts, no -o."""

import json
from pathlib import Path

import numpy as np
import pytest

import rom
from cases.command import rom as run_rom
from cases.files.schema import answer
from cases.files.step_parts import step_box, step_part, step_plate
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.components import cosserat
from rom.errors import ConfigError, MaterialError


@pytest.fixture
def pendulum():
    mech = rom.Mechanism(gravity=("9.81 m/s^2", 0, 0))
    mech.add_rigid("bob", mass="2 kg", inertia=(1e-3,) * 3, at=("500 mm", 0, 0),
                   markers={"pin": (-0.5, 0, 0)})  # fmt: skip
    mech.spherical("hung", "ground", "bob.pin")
    return mech


def test_markers_go_by_the_names_that_files_use(pendulum):
    (hung,) = pendulum.joints.values()
    bob = pendulum.part("bob")
    assert hung.markers == (pendulum.ground.marker((0, 0, 0)), bob.marker("pin"))
    assert pendulum.marker("bob") == bob.marker((0, 0, 0))
    pendulum.tendon("cord", ["ground", "bob"], EA=1e3)
    _, cord = pendulum.elements["cord"]
    assert [one.marker for one in cord.stations] == [hung.markers[0], bob.marker((0, 0, 0))]
    assert rom.linearize(pendulum).motion("bob.pin").shape[0] == 6


def test_a_body_whose_name_has_a_dot_is_found_before_its_marker(pendulum):
    pendulum.add_rigid("bob.pin", 1, (1, 1, 1), (0, 0, 0), markers={"a": (0, 0, 1)})
    assert pendulum.marker("bob.pin.a").body == "bob.pin"
    assert pendulum.marker("bob.pin").place == (0.0, 0.0, 0.0)


def test_frames_of_rods_are_found_as_in_files():
    mech = rom.Mechanism()
    section = {"stretch": (5e5, 5e5, 1e6), "bend": (1e3, 2e3, 1.5e3), "mass": 1.0}
    rod = cosserat.straight(10.0, 4, **section, inertia=(1e-2, 2e-2, 3e-2))
    whole = mech.add_nonlinear("rod", cosserat.body(rod))
    assert mech.marker("rod.end") == whole.marker("end") and mech.marker("rod.2") == whole.marker(2)


@pytest.mark.parametrize(
    ("place", "words"),
    [("bob.pn", "'bob.pn': body 'bob' has no marker 'pn'"), ("rob.pin", ".*no body 'rob'")],
)
def test_unknown_markers_are_told_with_the_argument(pendulum, place, words):
    said = f"Mechanism.spherical 'again': m2 = {words}"
    refuses(ConfigError, said, pendulum.spherical, "again", "ground", place)


def test_an_unknown_keyword_is_a_type_error_with_the_names_near_it(pendulum):
    with pytest.raises(TypeError, match=r"add_rigid.*unexpected keyword.*'pos'.*there are.*'at'"):
        pendulum.add_rigid("b", mass=1, inertia=(1, 1, 1), pos=(0, 0, 0))


def test_a_traceback_ends_where_the_user_made_the_call(pendulum):
    with pytest.raises(ConfigError) as caught:
        pendulum.add_rigid("b", mass="heavy", inertia=(1, 1, 1), at=(0, 0, 0))
    assert caught.traceback[-1].name == "at_border" and len(caught.traceback) == 2
    assert caught.value.__cause__ is None and caught.value.__suppress_context__


def test_quantities_with_units_are_numbers_in_si(pendulum):
    bob = pendulum.part("bob")
    assert bob.mass == 2.0 and bob.at.tolist() == [0.5, 0, 0]
    assert pendulum.gravity.tolist() == [9.81, 0, 0]
    solution = rom.simulate(pendulum, t_end="10 ms", dt=1e-3)
    assert solution.t[-1] == 0.01
    assert rom.Material(E="210 GPa", nu=0.3, rho="7.85 g/cm^3") == rom.Material.steel
    fibre = rom.Orthotropic(E=("40 GPa", 1e10, "10 GPa"), nu=(0.3,) * 3, G=(4e9,) * 3, rho=2e3)
    assert fibre.E == (40e9, 10e9, 10e9)


@pytest.mark.parametrize(
    ("mass", "words"),
    [("2 s", "is a time; a mass"), ("2", "has no unit"), ("-2 kg", " = -2 must be positive")],
)
def test_quantities_of_other_dimensions_are_refused_by_name(pendulum, mass, words):
    solid = {"mass": mass, "inertia": (1, 1, 1), "at": (0, 0, 0)}
    refuses(ConfigError, f"add_rigid 'b': mass.*{words}", pendulum.add_rigid, "b", **solid)


def test_numbers_of_solids_are_judged_like_others():
    refuses(MaterialError, "E = -1e", rom.Material, E="-1 GPa", nu=0.3, rho=1.0)
    refuses(ConfigError, "rho: '1 m' is a length", rom.Material, E=1.0, nu=0.3, rho="1 m")


def test_records_show_arrays_by_their_size(pendulum):
    shown = repr(rom.simulate(pendulum, t_end=1e-2, dt=1e-3).final)
    assert "q=[7]" in shown and "\n" not in shown and len(shown) < 300
    assert repr(rom.CraigBampton(n_modes=20)).startswith("CraigBampton(n_modes=20")


@pytest.mark.once
@pytest.mark.parametrize(
    ("asked", "panels"),
    [
        ("bob", ["position [mm]", "velocity [m/s]"]),
        (["bob.pin velocity", "total"], ["velocity [mm/s]", "total [J]"]),
        ((), ["position [mm]"]),
    ],
)
def test_curves_of_a_motion_are_asked_for_by_name(pendulum, asked, panels):
    pytest.importorskip("matplotlib", reason="pictures need matplotlib")
    solution = rom.simulate(pendulum, t_end=0.2, dt=1e-3)
    figure = rom.view.history(solution, asked)
    names = [axes.get_ylabel().partition(" [")[0] for axes in figure.axes]
    assert names == [panel.partition(" [")[0] for panel in panels]
    if asked == "bob":
        np.testing.assert_allclose(
            figure.axes[0].lines[0].get_ydata(), solution.position("bob")[:, 0]
        )
    refuses(ConfigError, r"no 'slider'.*bob position", rom.view.history, solution, "slider")


def test_any_file_is_told_what_it_is_with_the_next_command(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for text, name, what, command in (
        ("$MeshFormat", "a.msh", "", "rom mesh a.msh"), ("ISO", "a.stp", "CAD", "rom swing a.stp"),
        ("CHEXA,1", "a.bdf", "Nastran", "rom mesh a.bdf --units mm-t-s"),
        ("ctetra 1", "a.dat", "Nastran", "rom mesh a.dat --units mm-t-s"),
        ("*Element, a", "a.inp", "Abaqus", "rom mesh a.inp --units mm-t-s"),
        ("    -1\n  2412\n", "a.unv", "mesh", "rom mesh a.unv"),
        ("DMIG,K", "K.dat", "matrix", "rom modes K.dat --mass MASS --nodes NODES"),
        ("x", "test.unv", "vibration test", "rom update FAMILY test.unv"),
    ):  # fmt: skip
        Path(name).write_text(text)
        found = answer(capsys, "check", name)
        assert what in found["kind"] and command in found["next"]
    Path("bad.toml").write_text("[bodies.a]\nmas = 1\n")
    assert "mas" in answer(capsys, "check", "bad.toml", codes=(2,))["message"]
    for name in "a.bdf a.inp a.msh a.step a.xyz a.op4 gone".split():
        if name != "gone":
            Path(name).write_text("" if name == "a.op4" else "x")
        answer(capsys, "check", name, codes=(3,))


def test_outputs_have_names_of_their_own(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    rom.save(reduced(4, block(), reference="root", certify=True), "bar.rom.npz")
    command = ("simulate", "bar.rom.npz", "--hinge", "root", "--t-end", "10ms", "--dt", "1e-3")
    found = answer(capsys, *command, codes=(0, 5))
    assert Path(found["output"]).parent == Path("bar_motion")
    answer(capsys, "report", "bar_motion")
    assert Path("bar_motion.html").is_file()


@pytest.mark.fenicsx
def test_a_solid_by_name_is_that_by_numbers(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    step_box("bar.step", 100, 20, 10)
    base = ("modes", "bar.step", "-p", "lc=0.02", "-n", 8)
    of_numbers = answer(capsys, *base, "--E", "210e9", "--nu", "0.3", "--rho", "7850")
    assert answer(capsys, *base, "--material", "steel") == of_numbers
    softer = answer(capsys, *base, "--material", "steel", "--E", "52.5GPa")["frequencies"]
    np.testing.assert_allclose(2 * np.array(softer)[6:], of_numbers["frequencies"][6:], rtol=1e-9)
    found = answer(capsys, *base, "--E", "52.5GPx", codes=(2,))
    assert "--E" in found["message"] and "GPa" in str(found)


@pytest.mark.fenicsx
def test_solids_that_touch_are_one_where_that_is_asked_for(tmp_path, monkeypatch, capsys):
    """As the bar in one piece: the first bending frequency, to what another mesh changes."""
    monkeypatch.chdir(tmp_path)
    for name, at in (("touching", 100), ("apart", 101)):
        with step_part(f"{name}.step") as occ:
            occ.addBox(0, 0, 0, 100, 20, 10)
            occ.addBox(at, 0, 0, 100, 20, 10)
    step_box("whole.step", 200, 20, 10)
    how = ("-p", "lc=0.01", "--material", "steel", "-n", 7)
    assert "--unite" in answer(capsys, "modes", "touching.step", *how, codes=(3,))["hint"]
    answer(capsys, "modes", "apart.step", "--unite", *how, codes=(3,))
    one, two = (answer(capsys, "modes", name, "--unite", *how)["frequencies"][6]
                for name in ("touching.step", "whole.step"))  # fmt: skip
    assert one == pytest.approx(two, rel=1e-4)


@pytest.mark.fenicsx
@pytest.mark.slow
def test_a_part_alone_is_told_its_faces_and_the_next_command_works(tmp_path):
    """A face that is drawn, the command that is proposed, a report that turns at the end."""
    pytest.importorskip("pyvista", reason="pictures need pyvista")
    step_plate(tmp_path / "plate.step")
    asked = ("swing", "plate.step", "-p", "lc=0.012", "--unite", "--json", "-q")
    found = json.loads(run_rom(*asked, cwd=tmp_path).stdout)
    assert len(found["faces"]) == 9 and (tmp_path / found["files"][0]).stat().st_size > 20_000
    (command,) = found["next"]
    assert command == f"rom {' '.join(asked)} --hinge 7"
    ended = run_rom(*command.split()[1:], "-m", 4, cwd=tmp_path, timeout=900)
    assert ended.returncode in (0, 5), ended.stderr
    left = {Path(name).name for name in json.loads(ended.stdout)["files"]}
    assert left == set("plate.rom.npz plate.png plate.html motion.csv scene.json run.json".split())
    page = (tmp_path / "plate_swing" / "plate.html").read_text(encoding="utf-8")
    assert "The body: frequencies" in page and '"schema":"rom-scene"' in page
