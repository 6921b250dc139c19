"""Bodies of MBDyn and Exudyn come back: ours to the last digit, those of others as they mean it.

Examples of MBDyn itself, compared by hand: tests/joints/modal/beam/beam.fem is its cantilever, and
the blocks of tests/joints/modal/wallrapp/rotordynamics.fem agree with each other to round-off.
"""

import base64
import io
import json
import warnings
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.command import rom as command
from cases.files.damage import changed
from cases.mbs.mechanisms import random_body, simulate_quietly
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.errors import FileFormatError, ModelError, QualityGateError, RomWarning, UnsafeFileError
from rom.io.export import read_body
from rom.io.programs.exudyn import DATA_PATTERN
from rom.io.sid.body import invariants

pytestmark = pytest.mark.filterwarnings("ignore:the shapes of body")
ENDINGS = {"mbdyn": ".fem", "exudyn": ".py"}
INTEGRALS = ("mass", "first_moment", "inertia", "S", "Ibar_kl", "S_kl", "M", "K", "D", "omega")


def assert_same(back, body):
    for name in INTEGRALS:
        A = getattr(body, name)
        size = np.abs(A).max(initial=0.0) + np.finfo(float).tiny
        assert_allclose(getattr(back, name), A, atol=1e-12 * size, rtol=0, err_msg=name)
    assert list(back.markers) == list(body.markers)
    for name, marker in body.markers.items():
        for part in ("point", "translation", "rotation"):
            A, got = getattr(marker, part), getattr(back.markers[name], part)
            assert_allclose(got, A, atol=1e-12 * np.abs(A).max() + 1e-13, err_msg=part)
        turn = np.r_[
            np.zeros(3), 0.3, -0.2, 0.5
        ]  # about the origin: markers move across their arms
        moved = back.markers[name].hold @ np.r_[turn, np.zeros(body.n_modes)]
        assert_allclose(moved, np.r_[np.cross(turn[3:], marker.point), turn[3:]], atol=1e-12)
        motion = np.vstack([marker.translation, marker.rotation])
        assert_allclose(back.markers[name].hold[:, 6:], motion, atol=1e-12)


@pytest.mark.parametrize("to", ENDINGS)
@pytest.mark.parametrize("r", [1, 2, 5])
def test_a_body_comes_back_to_the_last_digit(to, r, tmp_path):
    body = random_body(np.random.default_rng(r), r=r)
    back = read_body(rom.export(body, tmp_path / f"rod{ENDINGS[to]}"))
    assert_same(back, body)
    assert (back.name, back.reference, back.units) == ("rod", "as in its file", "SI")
    again = read_body(rom.export(back, tmp_path / f"again{ENDINGS[to]}"))
    assert_same(again, back)
    assert rom.load(rom.save(back, tmp_path / "b.rom.npz")).reference == "as in its file"


def test_stiffening_comes_back_but_not_that_of_shapes(tmp_path):
    body = random_body(np.random.default_rng(2), stiffened=True)
    some = {load: A for load, A in body.K_geo.items() if load not in ("a_x", "b m_y")}
    path = rom.export(replace(body, K_geo=some), tmp_path / "b.fem")
    kept = {load: A for load, A in some.items() if not load.startswith("ddq_")}
    back = read_body(path)
    assert set(back.K_geo) == set(kept) and len(kept) == 22
    for load, A in kept.items():
        assert_array_equal(back.K_geo[load], A, err_msg=load)
    back.second_order()  # takes all of them
    text = path.read_text()
    number = f"{some['omega_x^2'][0, 3]:.16e}"
    path.write_text(text.replace(number, f"{some['omega_x^2'][0, 3] * (1 + 1e-8):.16e}", 1))
    A = read_body(path).K_geo["omega_x^2"]
    assert_array_equal(A, A.T)
    assert_allclose(A, some["omega_x^2"], rtol=1e-8)


def test_invariants_that_are_parts_of_others_may_be_missing(tmp_path):
    """Inv8 has all of Inv4, Inv9 all of Inv5."""
    body = random_body(np.random.default_rng(4))
    path = rom.export(body, tmp_path / "b.fem")
    head, *groups = path.read_text().split("** RECORD GROUP ")
    kept = [group for group in groups if not group.startswith(("15,", "17,"))]
    path.write_text("** RECORD GROUP ".join([head, *kept]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert_same(read_body(path), body)


def test_the_surface_of_a_module_comes_back(tmp_path):
    body = reduced(2, block(cells=(3, 1, 1)))
    back = read_body(rom.export(body, tmp_path / "b.py"))
    for name in ("points", "triangles", "shape"):
        assert_array_equal(getattr(back.surface, name), getattr(body.surface, name))


def test_a_body_that_swings_swings_alike_when_it_was_read(tmp_path):
    """A soft rod, hinged at its root; read bodies, and bodies read from what these write."""
    soft = block(cells=(4, 1, 1), material=rom.Material(E=2e6, nu=0.3, rho=1100.0))
    body = reduced(2, soft, damping=rom.Rayleigh(0.0, 2e-3))

    def tip(rod):
        mech = rom.Mechanism(gravity=(0.0, 0.0, -9.81))
        part = mech.add_flexible("rod", rod)
        root = mech.ground.marker(part.point(part.marker("root")))
        mech.revolute("hinge", root, part.marker("root"), axis=(0, 1, 0))
        return simulate_quietly(mech, t_end=0.1, dt=1e-3).position("rod", "tip")

    motion = tip(body)
    assert np.linalg.norm(motion[-1] - motion[0]) > 0.03
    for ending in ENDINGS.values():
        back = read_body(rom.export(body, tmp_path / f"rod{ending}"))
        assert_allclose(tip(back), motion, atol=1e-9)


GROUPS = {  # of two lumped masses and one shape; the second node turns, and has inertia of its own
    1: "HEADER\n** comment\n REV0 2 1 0 0 0",
    2: "LIST\n hook 17",
    5: "X\n1\n0",
    6: "Y\n0\n2",
    7: "Z\n0\n0",
    8: "SHAPES\n** NORMAL MODE SHAPE # 1\n0 0 1 0 0 0\n0 0.5 0 0 0 3",
    9: "MASS\n5.7",
    10: "STIFFNESS\n100",
    11: "LUMPED MASS\n2 2 2 0 0 0\n4 4 4 0.1 0.2 0.3",
}
RIGID = "INERTIA\n7\n1 0 2\n3 0.1 0\n0.1 4 0\n0 0 5"


def text(groups=GROUPS):
    return "** title\n" + "".join(f"** RECORD GROUP {k}, {words}\n" for k, words in groups.items())


def read(folder, groups=GROUPS, change=lambda words: words):
    (folder / "x.fem").write_text(change(text(groups)))
    return read_body(folder / "x.fem")


def test_lumped_masses_give_all_integrals(tmp_path):
    """By hand: 2 kg at x = 1 that moves along z, 4 kg at y = 2 that moves along y and turns."""
    body = read(tmp_path)
    assert body.mass == 6.0
    assert_allclose(body.first_moment, [2, 8, 0])
    assert_allclose(body.inertia, np.diag([16.1, 2.2, 18.3]), atol=1e-14)
    assert_allclose(body.S[:, 0], [0, 2, 2])
    # x x phi is (0, -2, 0) of the first mass, and 0.3 * 3 about z by what turns
    assert_allclose(invariants(body)["Inv4"][:, 0], [0, -2, 0.9], atol=1e-14)
    Ibar = [[0, 0.45, 2], [-0.45, 4, 0], [0, 0, 0]]
    assert_allclose(body.Ibar_kl[..., 0], Ibar, atol=1e-14)
    # 5.7 is 2 and 4 / 4 of what moves, and 0.3 * 9 of what turns, the same along all axes
    assert_allclose(body.S_kl[..., 0, 0], np.diag([0.9, 1.9, 2.9]), atol=1e-14)
    assert_allclose(body.M, [[5.7]])
    assert_allclose(body.omega, np.sqrt(100 / 5.7))
    assert not body.D.any() and list(body.markers) == ["hook", "17"]
    assert_array_equal(body.markers["17"].point, [0, 2, 0])
    assert_array_equal(body.markers["17"].translation[:, 0], [0, 0.5, 0])
    assert_array_equal(body.markers["17"].rotation[:, 0], [0, 0, 3])


def test_a_line_of_masses_has_no_free_motion(tmp_path):
    """As beams of MBDyn: they turn about themselves without inertia.

    With its hook at rest the other mass goes (0, 1/2, -1) q: 4 kg (1/4 + 1).
    """
    line = GROUPS | {6: "Y\n0\n0", 7: "Z\n0\n0", 9: "MASS\n3", 11: "M\n2 2 2 0 0 0\n4 4 4 0 0 0"}
    body = read(tmp_path, line)
    assert_allclose(np.diag(body.inertia), [0, 2, 2])
    refuses(ModelError, "a motion of the body has .*no mass", body.frequencies)
    assert_allclose(body.frequencies(fixed=("hook",)), np.sqrt(100 / 5) / (2 * np.pi))


def test_inertia_as_a_whole_replaces_that_of_lumped_masses(tmp_path):
    lumped, body = read(tmp_path), read(tmp_path, GROUPS | {12: RIGID})
    assert body.mass == 7.0
    assert_allclose(body.first_moment, [7, 0, 14])
    # about the origin: 7 (c.c - c c)
    assert_allclose(body.inertia, [[31, 0.1, -14], [0.1, 39, 0], [-14, 0, 12]])
    for name in ("S", "Ibar_kl", "S_kl"):
        assert_array_equal(getattr(body, name), getattr(lumped, name))


def test_without_lumped_masses_and_invariants_shapes_have_no_momentum(tmp_path):
    """As the modal joint takes it: of the body the rigid inertia, of the shape the modal mass."""
    alone = {k: words for k, words in GROUPS.items() if k != 11} | {12: RIGID}
    with pytest.warns(RomWarning, match="no Inv3, Inv8, Inv9;"):
        body = read(tmp_path, alone)
    assert not body.S.any() and not body.Ibar_kl.any() and body.mass == 7.0
    assert_allclose(body.S_kl[..., 0, 0], 1.9 * np.eye(3))
    # those of the invariants 3, 4 and 8, as for another program
    some = alone | {14: "I3\n1\n2\n3", 15: "I4\n0.1\n0.2\n0.3", 16: "I8\n9 1 2\n3 8 4\n5 6 7"}
    with pytest.warns(RomWarning, match="no Inv9;"):
        body = read(tmp_path, some)
    found = invariants(body)
    assert_allclose(found["Inv3"][:, 0], [1, 2, 3])
    assert_allclose(found["Inv4"][:, 0], [0.1, 0.2, 0.3])  # what turns, also where Inv8 differs
    I8 = np.array([[9, 1, 2], [3, 8, 4], [5, 6, 7]])
    assert_allclose((found["Inv8"][:, 0] + found["Inv8"][:, 0].T) / 2, (I8 + I8.T) / 2)


def test_a_lumped_mass_that_is_not_the_modal_mass_is_told(tmp_path):
    """As of a file whose hidden nodes are left out; the modal mass counts."""
    with pytest.warns(RomWarning, match="another mass than record group 9, by 2.3"):
        body = read(tmp_path, GROUPS | {9: "MASS\n8"})
    assert_allclose(body.M, [[8.0]])
    assert_allclose(body.S[:, 0], [0, 2, 2])


def test_habits_of_other_writers_are_read(tmp_path):
    expected = read(tmp_path)
    for change in (
        lambda t: t.replace("RECORD GROUP", "Record  group").replace("** R", "**R"),
        lambda t: t.replace("1\n0\n** RECORD GROUP 6", " 1.0D+00 \t 0\n\n\n**\n** RECORD GROUP 6"),
        lambda t: t.replace("0.3\n", "0.3\n0 0 0 0. 0 0\n"),  # a row of zeros more, from NASTRAN
        lambda t: t + "** END OF FILE\nwhat stands behind\n** RECORD GROUP 99\n",
        lambda t: t.replace("REV0 2 1 0 0 0", "any 2 0 1 1 1")  # the first is rejected
                   .replace("# 1\n", "# 0\n9 9 9 9 9 9\n9 9 9 9 9 9\n** # 1\n"),
        lambda t: t.replace("\n", "\r\n"),
        lambda t: t.replace("** comment", "revision, 7 nodes"),  # any line, but one
    ):  # fmt: skip
        assert_same(read(tmp_path, change=change), expected)
    with pytest.warns(RomWarning, match="amplitudes at the start"):
        assert_same(read(tmp_path, GROUPS | {3: "START\n0.5", 4: "RATES\n0"}), expected)


STIFF = GROUPS | {13: "DAMPING\n2", 19: "STRESS\n2\n1\n30\n18\n40"}


def test_loads_of_stiffening_stand_at_their_numbers(tmp_path):
    body = read(tmp_path, STIFF)
    assert {load: A.item() for load, A in body.K_geo.items()} == {"omega_x^2": 30, "hook m_z": 40}
    assert body.D.item() == 2.0


test_broken_files_are_named_with_what_is_wrong = changed(
    lambda: text(STIFF),
    "x.fem",
    read_body,
    ("GROUP 9,", "GROUP 20,", "record group 20 is twice or unknown"),
    ("GROUP 9,", "GROUP 10,", "record group 10 is twice or unknown"),
    ("** RECORD GROUP 9", "** the ninth", "lacks the record groups 9"),
    ("** RECORD GROUP 10, STIFFNESS\n100\n", "", "lacks the record groups 10"),
    ("REV0 2 1", "REV0 1 1", "no list of 1 labels"),
    ("REV0 2 1", "REV0 2 2", "has .* numbers, not"),
    ("REV0 2 1", "REV0 2 0", "does not count nodes and modes"),
    ("REV0 2 1 0 0 0", "REV0 2 1 0 0", "not enough values|does not count"),
    ("REV0 2 1 0 0 0", "REV0 2 -1 2 0 0", "does not count nodes and modes"),
    ("REV0 2 1", "REV0 99999999 1", UnsafeFileError, "do not fit the file"),
    ("REV0 2 1", "REV0 2 9999", UnsafeFileError, "do not fit the file"),
    ("hook 17", "hook hook", "no list of 2 labels"),
    ("5.7", "nan", "no finite number"),
    ("0.5", "1e999", "no finite number"),
    ("5.7", "-5.7", QualityGateError, "modal mass must be positive"),
    ("5.7", "0", QualityGateError, "modal mass must be positive"),
    ("\n100\n", "\n-100\n", QualityGateError, "stiffness must be positive"),
    ("DAMPING\n2", "DAMPING\n-2", QualityGateError, "damping must be positive"),
    ("4 4 4 0.1", "4 4 4 -0.1", "lumped masses must be positive"),
    ("2 2 2 0", "-2 -2 -2 0", "lumped masses must be positive"),
    ("4 4 4", "4 3 4", "the same along x, y and z"),
    ("0.2 0.3\n", "0.2 0.3\n7 7 7 0 0 0\n", "record group 11 has 18 numbers, not 12"),
    ("STRESS\n2\n1", "STRESS\n2\n18", "not of loads 1 to 24, each once"),
    ("STRESS\n2\n1", "STRESS\n2\n25", "not of loads 1 to 24, each once"),
    ("STRESS\n2", "STRESS\n3", "record group 19 has 4 numbers, not 6"),
    ("\n40\n", "\n40", "the last line is cut"),
)


def test_what_no_body_can_be_made_of_is_refused_by_name(tmp_path):
    light = {k: words for k, words in GROUPS.items() if k != 11}
    nothing = "neither record group 11 nor 12 says the mass"
    refuses(FileFormatError, nothing, read, tmp_path, light)
    refuses(FileFormatError, nothing, read, tmp_path, light | {14: "I3\n1\n2\n3"})
    both = GROUPS | {14: "I3\n1\n2\n3"}
    refuses(FileFormatError, "lumped masses and invariants", read, tmp_path, both)
    minus = GROUPS | {12: "INERTIA\n-7\n0 0 0\n3 0 0\n0 4 0\n0 0 5"}
    refuses(QualityGateError, "the mass must be positive", read, tmp_path, minus)
    uneven = GROUPS | {12: RIGID.replace("0.1 4", "0.2 4")}
    refuses(QualityGateError, "the inertia is not symmetric", read, tmp_path, uneven)
    body = random_body(np.random.default_rng(2), stiffened=True)
    path = rom.export(body, tmp_path / "b.fem")
    lines = path.read_text().splitlines()
    first = 3 + next(k for k, line in enumerate(lines) if "GROUP 19," in line)
    lines[first] = " ".join([*lines[first].split()[:3], "9.0"])
    path.write_text("\n".join(lines) + "\n")
    refuses(QualityGateError, "geometric stiffness 'omega_x.2' is not sym", read_body, path)
    (tmp_path / "deck.fem").write_text("GRID,1,,0.,0.,0.\nCTETRA,1,1,1,2,3,4\n")
    refuses(FileFormatError, "no modal data file of MBDyn", read_body, tmp_path / "deck.fem")


def with_data(path, names, data):
    """The module with other blocks of data."""
    blocks = iter([names, data])
    coded = lambda found: found[0].replace(found[1], base64.b64encode(next(blocks)).decode())  # noqa: E731
    path.write_text(DATA_PATTERN.sub(coded, path.read_text()))


def test_a_module_is_read_and_never_run(tmp_path):
    body = random_body(np.random.default_rng(3))
    path = rom.export(body, tmp_path / "rod.py")
    trace = tmp_path / "trace"
    path.write_text(f"open({str(trace)!r}, 'w')\n{path.read_text()}\nraise SystemExit\n")
    assert_same(read_body(path), body)
    assert not trace.exists()
    (tmp_path / "mesh.py").write_text("import gmsh\n")
    wrong = "this is no module for Exudyn that rom has written"
    refuses(FileFormatError, f"mesh.py: {wrong}", read_body, tmp_path / "mesh.py")


def test_data_of_a_module_that_belong_to_no_body_are_refused(tmp_path):
    body = random_body(np.random.default_rng(3))
    whole = rom.export(body, tmp_path / "rod.py").read_text()
    names, data = (base64.b64decode(text) for text in DATA_PATTERN.findall(whole))
    with np.load(io.BytesIO(data)) as found:
        arrays = dict(found)

    def refused(error, words, names=names, **others):
        path, memory = tmp_path / "rod.py", io.BytesIO()
        path.write_text(whole)
        np.savez(memory, **{k: A for k, A in (arrays | others).items() if A is not None})
        with_data(path, names, memory.getvalue())
        refuses(error, f"(?s)rod.py.*{words}", read_body, path)

    refused(FileFormatError, "inertia", inertia=None)
    refused(FileFormatError, "not finite", S=np.array([np.nan]))
    refused(FileFormatError, "cannot reshape", mPhitTPsi=np.zeros((3, 3)))
    refused(FileFormatError, "not those of its names", triangles=np.array([[12, 13, 900]]))
    refused(FileFormatError, "not those of its names", triangles=np.array([[1, 2, 3]]))
    refused(FileFormatError, "not those of its names", names=b'["a", "a"]')
    refused(FileFormatError, "no module for Exudyn", names=b'["a"')
    refused(UnsafeFileError, "type", K=np.array([{}, 1], dtype=object))
    refused(QualityGateError, "the mass must be positive", mass=np.array(-1.0))
    refused(QualityGateError, "stiffness is not symmetric", K=np.triu(arrays["K"]) + np.eye(4))
    refused(QualityGateError, "damping must be positive", D=-arrays["D"])
    path, memory = tmp_path / "rod.py", io.BytesIO()
    with zipfile.ZipFile(memory, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("K.npy", bytes(2**20))
    bomb = memory.getvalue().replace((2**20).to_bytes(4, "little"), b"\xff\xff\xff\xff")
    path.write_text(whole)
    with_data(path, names, bomb)
    refuses(FileFormatError, "rod.py", read_body, path)


@pytest.mark.once
def test_the_command_line_takes_bodies_of_both_programs(tmp_path):
    body = random_body(np.random.default_rng(1))
    for program, ending in (("MBDyn", ".fem"), ("Exudyn", ".py")):
        path = rom.export(body, tmp_path / f"b{ending}")
        told = json.loads(command("check", path, "--json").stdout)
        assert program in told["kind"] and told["next"][0].startswith(f"rom export {path}")
        assert command("export", path, tmp_path / "c.rom.npz").returncode == 0
        assert_allclose(rom.load(tmp_path / "c.rom.npz").K, body.K, rtol=1e-12, atol=1e-12)
    refuses(FileFormatError, "rom export FILE.fem BODY.rom.npz", rom.load, tmp_path / "b.fem")
