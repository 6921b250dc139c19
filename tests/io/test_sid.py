"""Standard Input Data: the motion its blocks describe, its dialects, and files that are broken."""

import json
import re
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases import solid
from cases.command import rom as command
from cases.files.damage import changed
from cases.mbs.mechanisms import nodal_body, random_body, random_nodes
from cases.mbs.particles import motion, particles
from cases.refusals import refuses
from rom.errors import ConfigError, FileFormatError, RomWarning, UnsafeFileError
from rom.io.sid.body import sid_body, standard_input
from rom.io.sid.dialect import check_sid, read_sid
from rom.io.sid.format import DIALECTS, Taylor, write_sid

RNG = np.random.default_rng(11)
NODES = random_nodes(np.random.default_rng(5), n=7, r=4)
STIFFENED = random_body(np.random.default_rng(7), stiffened=True)


def rows(record, q, qd, qdd, a, omega, domega):
    """Left-hand sides of the three rows of equations, from the blocks alone."""
    b = record.blocks

    def at(name):
        block = b[name]
        return block.M0 + (0.0 if block.M1 is None else np.tensordot(q, block.M1, 1))

    r = q.size
    md, J, Ct, Cr = at("mdCM")[:, 0], at("J"), at("Ct"), at("Cr")
    Gr = np.einsum("j,aj->a", qd, np.einsum("acj,c->aj", at("Gr").reshape(3, 3, r), omega))
    Ge = np.einsum("j,icj,c->i", qd, at("Ge").reshape(r, 3, r), omega)
    x, y, z = omega
    W = np.array([x * x, y * y, z * z, x * y, y * z, x * z])
    cross = np.cross
    force = record.mass * a - cross(md, domega) + Ct.T @ qdd + 2 * cross(omega, Ct.T @ qd)
    force += cross(omega, cross(omega, md))
    moment = cross(md, a) + J @ domega + Cr.T @ qdd + Gr + cross(omega, J @ omega)
    elastic = Ct @ a + Cr @ domega + at("Me") @ qdd + Ge + at("Oe") @ W + at("ksigma")[:, 0]
    return force, moment, elastic + at("Ke") @ q + at("De") @ qd


@pytest.mark.parametrize("dialect", DIALECTS)
def test_forces_and_elastic_rows_are_those_of_particles(dialect, tmp_path):
    """With blocks of first order these rows are exact, for deformations of any size."""
    body = nodal_body(*NODES)
    record = read_sid(write_sid(standard_input(body), tmp_path / "b.SID_FEM", dialect=dialect))
    got, expected = rows(record, *motion()), particles(NODES, *motion())
    for row in (0, 2):
        assert_allclose(got[row], expected[row], atol=1e-9 * np.abs(expected[row]).max())


def test_moments_are_those_of_particles_to_first_order():
    """SID has no place for the second order of J and Gr: the error falls with the square."""
    record = standard_input(nodal_body(*NODES))
    apart = [rows(record, *motion(s))[1] - particles(NODES, *motion(s))[1] for s in (1e-2, 1e-3)]
    assert 80 < np.abs(apart[0]).max() / np.abs(apart[1]).max() < 120


def test_stiffening_adds_its_matrices_to_loads():
    """The load l adds K_l to the stiffness; forces on nodes stand on the other side."""
    full, plain = (standard_input(b) for b in (STIFFENED, replace(STIFFENED, K_geo={})))
    q, _, _, a, omega, domega = motion()
    more = rows(full, *motion())[2] - rows(plain, *motion())[2]
    x, y, z = omega
    loads = dict(zip(("a_x", "a_y", "a_z"), a, strict=True))
    loads |= dict(zip(("domega_x", "domega_y", "domega_z"), domega, strict=True))
    loads |= {"omega_x^2": x * x, "omega_y^2": y * y, "omega_z^2": z * z}
    loads |= {"omega_x omega_y": x * y, "omega_y omega_z": y * z, "omega_x omega_z": x * z}
    assert_allclose(more, sum(s * STIFFENED.K_geo[load] @ q for load, s in loads.items()))
    for kind, block in (("f", "phi"), ("m", "psi")):
        for axis, letter in enumerate("xyz"):
            change = np.tensordot(q, full.nodes["a"][block].M1, 1)[axis]
            assert_allclose(change, -STIFFENED.K_geo[f"a {kind}_{letter}"] @ q)


def test_ge_does_no_work_even_with_angular_stiffening():
    record = standard_input(STIFFENED)
    Ge = record.blocks["Ge"].M0.reshape(4, 3, 4)
    assert_allclose(Ge, -Ge.transpose(2, 1, 0), atol=1e-14)
    Cr1 = record.blocks["Cr"].M1
    assert np.abs(Cr1 + Cr1.swapaxes(0, 1)).max() > 0.1  # stiffening went there, and stays there


@pytest.mark.parametrize("dialect", DIALECTS)
@pytest.mark.parametrize("r", [1, 2, 3, 6, 11])
def test_every_dialect_is_told_and_comes_back_equal(dialect, r, tmp_path):
    body = random_body(np.random.default_rng(r), r=r, stiffened=True)
    record = standard_input(body)
    path = write_sid(record, tmp_path / "b.SID_FEM", dialect=dialect)
    back = read_sid(path)
    if r > 1:
        assert back.dialect == dialect
    assert_record_equal(back, record)
    again = write_sid(back, tmp_path / "again.SID_FEM", dialect=dialect)
    assert again.read_bytes() == path.read_bytes()
    report = check_sid(back)
    assert report.ok, report
    assert all(row.value < 1e-10 for row in report.rows[:-1])


def assert_record_equal(back, record):
    assert (back.title, back.name) == (record.title, record.name)
    assert back.mass == pytest.approx(record.mass, rel=1e-11)
    assert len(back.coordinates) == len(record.coordinates)
    pairs = [(back.blocks, record.blocks)]
    pairs += [(back.nodes[label], node) for label, node in record.nodes.items()]
    assert list(back.nodes) == list(record.nodes)
    for got, expected in pairs:
        assert set(got) == set(expected)
        for name, block in expected.items():
            assert_allclose(got[name].M0, block.M0, rtol=1e-11, atol=0, err_msg=name)
            assert (got[name].M1 is None) == (block.M1 is None), name
            if block.M1 is not None:
                assert_allclose(got[name].M1, block.M1, rtol=1e-11, atol=0, err_msg=name)


def entries(path, name, kind):
    """{indices: value} of a block of a file, found without the reader."""
    text = path.read_text()
    inside = text[text.index(f" {name}\n") : text.index(f" end {name}\n")]
    found = re.findall(rf"{kind}\(([\d, ]+)\) *=(.*)", inside)
    return {tuple(map(int, i.split(","))): float(v.replace("D", "E")) for i, v in found}


LAYOUTS = {  # mode second in Oe1, axes first in Gr and in Ge, six numbers of J
    "fembs": (True, True, True, True),
    "pysid": (True, False, True, True),
    "geisler": (False, False, False, False),
}


@pytest.mark.parametrize("dialect", LAYOUTS)
def test_dialects_have_the_layouts_measured_in_public_files(dialect, tmp_path):
    """Blocks from the nodes themselves: Gr_j = -2 int x~ phi~_j, Ge_j = 2 int phi_j x phi_i."""
    mode_second, gr_axis, ge_axis, six = LAYOUTS[dialect]
    x, Ms, phi, K, D = NODES
    record = standard_input(nodal_body(x, Ms, phi, K, D))
    path, r, j, axis = tmp_path / "b.SID_FEM", 4, 2, 1
    write_sid(record, path, dialect=dialect)
    by_axis, by_mode = axis * r + j + 1, 3 * j + axis + 1
    skew = [np.cross(np.eye(3), v).T for v in x], [np.cross(np.eye(3), v).T for v in phi[j]]
    Gr = -2 * np.einsum("nm,nab,mbc->ac", Ms, *skew)
    got = entries(path, "Gr", "m0")[2, by_axis if gr_axis else by_mode]
    assert_allclose(got, Gr[1, axis], rtol=1e-10)
    Ge = 2 * np.einsum("nm,inma->ia", Ms, np.cross(phi[j][None, :, None], phi[:, None, :]))
    got = entries(path, "Ge", "m0")[1, by_axis if ge_axis else by_mode]
    assert_allclose(got, Ge[0, axis], rtol=1e-10)
    Oe = np.einsum("nm,na,mb->ab", Ms, phi[j], phi[0])  # column 5 is y z
    got = entries(path, "Oe", "m1")[(1, j + 1, 5) if mode_second else (1, 5, j + 1)]
    assert_allclose(got, Oe[1, 2] + Oe[2, 1], rtol=1e-10)
    J = entries(path, "J", "m0")
    assert_allclose(J[5, 1] if six else J[3, 1], record.blocks["J"].M0[0, 2], rtol=1e-10)
    assert ((1, 2) in J) is False  # a column, or the lower triangle alone


def test_numbers_stand_where_fortran_puts_them(tmp_path):
    path = write_sid(standard_input(random_body(RNG)), tmp_path / "b.SID_FEM")
    lines = path.read_text().splitlines()
    assert all(line.index("=") == 48 for line in lines if "=" in line and "modal =" not in line)
    mass = next(line for line in lines if line.split()[0] == "mass")
    assert mass[48:50] == "= " and mass[-4:-2] == "D+" and len(mass) == 48 + 1 + 18
    assert lines[0].startswith("2 4 :No. nodes, No. modes:")


def test_columns_in_a_wrong_order_are_seen_by_the_check(tmp_path):
    """Shapes agree; only the relations between the blocks tell."""
    record = standard_input(random_body(RNG, r=3))
    for name in ("Gr", "Ge"):
        M0 = record.blocks[name].M0[:, np.random.default_rng(1).permutation(9)]
        bad = replace(record, blocks=record.blocks | {name: Taylor(M0)})
        failed = [row.quantity for row in check_sid(bad).failures]
        assert failed and all(name in quantity for quantity in failed)


def test_each_block_is_checked_against_another():
    record = standard_input(random_body(RNG, r=3))
    against = {"mdCM": "mdCM1", "Oe": "Oe0", "J": "Gr", "Cr": "Gr - Gr", "Ct": "mdCM1"}
    for name, what in against.items():
        block = record.blocks[name]
        M1 = None if block.M1 is None else 1.01 * block.M1
        bad = replace(record, blocks=record.blocks | {name: Taylor(1.01 * block.M0, M1)})
        assert any(row.quantity.startswith(what) for row in check_sid(bad).failures), name


def test_a_body_comes_back_from_its_sid_but_not_a_stiffened_one(tmp_path):
    x, Ms, phi, K, D = NODES
    markers = {"a": (x[0], phi[:, 0].T, 0.2 * RNG.normal(size=(3, 4)))}
    body = nodal_body(x, Ms, phi, K, D, markers)
    rom.export(body, tmp_path / "b.SID_FEM")
    back = sid_body(rom.read_sid(tmp_path / "b.SID_FEM"))
    for name in ("mass", "first_moment", "inertia", "S", "Ibar_kl", "S_kl", "K", "D", "omega"):
        assert_allclose(getattr(back, name), getattr(body, name), atol=1e-10, err_msg=name)
    for part in ("point", "translation", "rotation"):
        assert_allclose(getattr(back.markers["a"], part), getattr(body.markers["a"], part))
    turn = np.array([0.0, 0.0, 1.0])  # about the body origin: the marker moves across its arm
    moved = back.markers["a"].hold @ np.r_[0, 0, 0, turn, np.zeros(4)]
    assert_allclose(moved, np.r_[np.cross(turn, x[0]), turn], atol=1e-12)
    rom.export(STIFFENED, tmp_path / "b.SID_FEM")
    refuses(ConfigError, "geometric stiffness in Oe", sid_body, read_sid(tmp_path / "b.SID_FEM"))


def test_blocks_that_no_body_has_are_named_with_their_line(tmp_path):
    """As a public program writes Oe1 of several modes: products depend on the order of modes."""
    record = standard_input(random_body(RNG, r=3))
    Oe = record.blocks["Oe"]
    Oe1 = Oe.M1.copy()
    Oe1[0, 1, 4] *= 2.0
    bad = replace(record, blocks=record.blocks | {"Oe": Taylor(Oe.M0, Oe1)})
    found = read_sid(write_sid(bad, tmp_path / "b.SID_FEM", dialect="pysid"))
    lines = (tmp_path / "b.SID_FEM").read_text().splitlines()
    at = next(k for k, line in enumerate(lines, 1) if line.split() == ["Oe"])
    assert_allclose(found.blocks["Oe"].M1, Oe1, rtol=1e-11)  # the blocks are read as they are
    (row,) = check_sid(found).failures
    assert row.quantity == f"Oe1 symmetric, Oe (line {at})"
    refuses(ConfigError, rf"Oe \(line {at}\).* columns yz .*not symmetric", sid_body, found)


def test_a_unit_block_may_have_its_entries(tmp_path):
    """FEMBS writes AP with the structure of a unit matrix and its ones; other numbers are wrong."""
    path = write_sid(standard_input(random_body(RNG, r=2)), tmp_path / "a.SID_FEM")
    text, wanted = path.read_text(), read_sid(path)
    order = re.compile(r"( AP\n.*?)order( *)= 1(.*?)structure( *)= \d\n.*?( +end AP)", re.S)
    unit = order.sub(r"\1order\2= 0\3structure\4= 4\n m0(1,1) = 1.0\n m0(3,3) = 1D0\n\5", text)
    assert unit.count("m0(3,3)") == len(wanted.nodes)
    (tmp_path / "b.SID_FEM").write_text(unit)
    for node in read_sid(tmp_path / "b.SID_FEM").nodes.values():
        assert_array_equal(node["AP"].M0, np.eye(3))
    (tmp_path / "b.SID_FEM").write_text(unit.replace("m0(3,3) = 1D0", "m0(3,3) = 2D0", 1))
    wrong = r"line \d+: .*AP has entries, but the structure 4"
    refuses(FileFormatError, wrong, read_sid, tmp_path / "b.SID_FEM")


def test_ge_with_stiffening_inside_is_cleaned_with_a_warning(tmp_path):
    """Files of a well-known program have it there; it would create energy."""
    record = standard_input(random_body(RNG, r=2))
    Ge = record.blocks["Ge"].M0
    bad = replace(record, blocks=record.blocks | {"Ge": Taylor(Ge + 0.1 * np.eye(2, 6))})
    path = write_sid(bad, tmp_path / "b.SID_FEM")
    with pytest.warns(RomWarning, match="part of Ge that does work"):
        clean = read_sid(path)
    assert_allclose(clean.blocks["Ge"].M0, Ge, rtol=1e-11, atol=1e-16)
    kept = read_sid(path, ge="as_written")
    assert_allclose(kept.blocks["Ge"].M0, bad.blocks["Ge"].M0, rtol=1e-11)
    refuses(ConfigError, "ge = 'none'", read_sid, path, ge="none")


def test_habits_of_other_writers_are_read(tmp_path):
    """Small letters of exponents, whole numbers, tabs, empty lines, terms of second order."""
    path = write_sid(standard_input(random_body(RNG)), tmp_path / "a.SID_FEM")
    expected = read_sid(path)
    text = path.read_text().replace("D+00", "e+00").replace("D-01", "d-01")
    text = text.replace("\n", "\r\n\n").replace("                =", "\t=\t")
    (tmp_path / "b.SID_FEM").write_text(text)
    assert_record_equal(read_sid(tmp_path / "b.SID_FEM"), expected)
    text = path.read_text().replace("end mdCM", "mn( 1, 1, 1) = 2\n end mdCM")
    (tmp_path / "c.SID_FEM").write_text(text)
    with pytest.warns(RomWarning, match="1 terms of second order"):
        assert_record_equal(read_sid(tmp_path / "c.SID_FEM"), expected)


def of_two_modes():
    with TemporaryDirectory() as folder:
        path = write_sid(standard_input(random_body(RNG, r=2)), Path(folder) / "x.SID_FEM")
        return path.read_text()


test_broken_files_are_named_with_the_line = changed(
    of_two_modes,
    "x.SID_FEM",
    read_sid,
    (" part\n", "", r"line \d+: .*'part' was expected"),
    ("D+00", "Q+00", r"line \d+: .*is no finite number"),
    ("0D+00", "0D+999", r"line \d+: .*is no finite number"),
    ("m0( 1, 1)", "m0( 1,99)", r"line \d+: .*m0\( 1,99\) is outside"),
    ("m0( 1, 1)", "m0( 0, 1)", r"line \d+: .*is outside"),
    ("m0( 1, 1)", "mm( 1, 1)", r"line \d+: .*is no entry of a block"),
    ("mdCM", "mdCN", r"line \d+: .*'mdCN' is unknown"),
    ("nrow", "nrom", r"line \d+: .*(no entry of a block|before the sizes)"),
    ("structure" + 23 * " " + "= 3", "structure = 9", r"line \d+: .*the structure 9"),
    ("nelastq" + 25 * " " + "=2", "nelastq = 999999999", UnsafeFileError, "limit of 1000"),
    ("nelastq", "nelastr", r"line \d+: .*are no body"),
)


@pytest.mark.once
def test_the_command_line_writes_checks_and_reads_back(tmp_path):
    body = nodal_body(*NODES)
    rom.save(body, tmp_path / "b.rom.npz")
    path = tmp_path / "b.SID_FEM"
    assert command("export", tmp_path / "b.rom.npz", path, "--to", "sid-pysid").returncode == 0
    done = command("check", path, "--json")
    answer = json.loads(done.stdout)
    assert done.returncode == 0 and answer["dialect"] == "pysid" and answer["report"]["ok"]
    assert command("export", path, tmp_path / "c.rom.npz").returncode == 0
    assert_allclose(rom.load(tmp_path / "c.rom.npz").K, body.K, rtol=1e-11, atol=1e-11)
    assert command("export", path, tmp_path / "c.xyz").returncode == 2
    path.write_text(path.read_text()[:3000])
    assert command("check", path).returncode == 3


def test_mean_axis_bodies_have_round_off_where_nothing_stands(tmp_path):
    """Zero momentum of the shapes must not be compared digit by digit."""
    body = solid.reduced(3, solid.block(cells=(4, 1, 1)))
    for dialect in DIALECTS:
        path = write_sid(standard_input(body), tmp_path / "b.SID_FEM", dialect=dialect)
        record = read_sid(path)
        assert check_sid(record).ok and record.dialect == dialect
    assert_array_equal(list(record.nodes), list(body.markers))


def test_stiffness_of_modes_is_written_as_the_diagonal_it_is(tmp_path):
    rom.export(solid.reduced(3, solid.block(), reference="root"), tmp_path / "body.SID_FEM")
    text = (tmp_path / "body.SID_FEM").read_text()
    kind = r"\n +(\w+)\n +order [^\n]*\n(?:[^\n]*\n){4} +structure += +(\d)"
    kinds = dict(re.findall(kind, text))
    assert (kinds["Ke"], kinds["Me"]) == ("1", "2")  # diagonal, symmetric
