"""Tests of vibration from files: two other programs, tables, HDF5; what contradicts is named."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.files.decks import IM, RE, X, dataset
from cases.paths import TESTS
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.errors import ConfigError, FileFormatError
from rom.updating import Channels, Plan, Responses

HERE = TESTS / "reference" / "foreign"
F = np.arange(2.0, 14.0, 2.0)
NODES = {5: (0.1, 0.2, 0.3), 9: (0.4, -0.5, 0.6), 11: (-0.7, 0.8, 0.0)}  # [m]
ACCELERANCE = [1 / (30 + 1j * F), 2 * (1 / (30 + 1j * F) + 0.01)]  # [m/s^2/N]
COHERENCE = [1 - 0.01 * k * np.arange(1, 7) / 6 for k in (1, 2)]
SHAPES = [
    [(0.1, 0.2, -0.3), (0, 0, 1.0), (0.5, -0.25, 0)],
    [(1.0, 0, 0), (0.3, 0.2, 0.1), (0, -1.0, 0.5)],
]


def fields(test):
    return (test.frequencies, test.H, test.coherence, test.sensors.points, test.sensors.directions,
            test.inputs.points, test.inputs.directions, test.averages, test.quantity)  # fmt: skip


@pytest.mark.parametrize("name", ["pyuff_test.uff", "sdynpy_test.unv"])
def test_a_test_of_another_program_is_read_in_si_units(name):
    """By pyuff 2.5.8 and SDynPy 0.23.0 in mm and mN; one labels axes, one has dataset 164."""
    test = rom.io.read_responses(HERE / name, averages=20)
    assert_allclose(test.frequencies, F)
    power = -((2 * np.pi * F) ** 2)
    for k in range(2):
        assert_allclose(test.H[:, k, 0], ACCELERANCE[k] / power, rtol=1e-9)
        assert_allclose(test.coherence[:, k, 0], COHERENCE[k], rtol=1e-6)
    assert_allclose(test.sensors.points, [NODES[5], NODES[9]], rtol=1e-6)
    assert_array_equal(test.sensors.directions, [[0, 1, 0], [0, 0, -1]])
    assert_allclose(test.inputs.points, [NODES[11]], rtol=1e-6)
    assert_array_equal(test.inputs.directions, [[0, 0, -1]])
    assert test.averages == 20 and test.quantity == "displacement"


@pytest.mark.once
@pytest.mark.parametrize("binary", [0, 1])
def test_pyuff_reads_the_points_that_are_written_and_writes_what_is_read(tmp_path, binary):
    pyuff = pytest.importorskip("pyuff", reason="pyuff is not installed")
    sensors = Channels([NODES[5], NODES[9]], [[0, 1, 0], [0, 0, -1]])
    force = Channels([NODES[11]], [[0, 0, -1]])
    plan = Plan(sensors, force, np.arange(2), np.arange(1), (), np.zeros((0, 0)), ())
    (tmp_path / "plan.uff").write_text(plan.uff())
    file = pyuff.UFF(str(tmp_path / "plan.uff"))
    found = file.read_sets(0)
    assert file.get_set_types().tolist() == [15]
    assert_allclose(np.column_stack([found[c] for c in "xyz"]), list(NODES.values()), atol=1e-6)
    file = pyuff.UFF(str(tmp_path / "test.uff"))
    file.write_sets([found], mode="add")
    axes = {"abscissa_min": F[0], "abscissa_inc": 2.0, "abscissa_spacing": 1}
    axes |= {"ordinate_spec_data_type": 12, "orddenom_spec_data_type": 13}
    units = {"ordinate": "m/s^2", "orddenom": "N", "abscissa": "Hz"}
    axes |= {f"{name}_axis_units_lab": unit for name, unit in units.items()}
    for node, axis, H in ((1, 2, ACCELERANCE[0]), (2, -3, ACCELERANCE[1])):
        one = {"rsp_node": node, "rsp_dir": axis, "ref_node": 3, "ref_dir": -3, "data": H, "x": F}
        file.write_sets([pyuff.prepare_58(binary=binary, func_type=4, **one, **axes)], mode="add")
    test = rom.io.read_responses(tmp_path / "test.uff", averages=20, coherence=0.9)
    assert_allclose(test.frequencies, F)
    power = -((2 * np.pi * F[:, None]) ** 2)
    assert_allclose(test.H[:, :, 0] * power, np.transpose(ACCELERANCE), rtol=1e-5)
    for read, written in ((test.sensors, sensors), (test.inputs, force)):
        assert_allclose(read.points, written.points, atol=1e-6)
        assert_array_equal(read.directions, written.directions)


@pytest.mark.parametrize(("name", "factor"), [("pyuff_test.uff", 1), ("sdynpy_test.unv", 1 + 0.5j)])
def test_modes_of_another_program_are_read(name, factor):
    modes = rom.io.read_modes(HERE / name)
    assert_allclose(modes.frequencies, [12.5, 31.0], rtol=1e-5)
    assert_allclose(modes.damping, [0.01, 0.02], rtol=1e-5)
    assert_allclose(modes.points, list(NODES.values()), rtol=1e-6)
    assert_allclose(modes.shapes, factor * np.array(SHAPES), rtol=1e-5)


def modes_of(body, factors, order):
    """Its own first modes, held at the root, at six points."""
    omega, Phi = body.modes(fixed=("root",))
    points = body.surface.points[[-1, -9, -17, 20, 12, 8]]
    axes = np.tile(np.eye(3), (6, 1))
    rows = Channels(np.repeat(points, 3, axis=0), axes).rows(body, "point")
    shapes = (rows @ Phi[:, order]).T.reshape(len(order), 6, 3)
    shapes = np.asarray(factors)[:, None, None] * shapes
    f = omega[order] / (2 * np.pi)
    return rom.updating.MeasuredModes(f, np.zeros(len(order)), points, shapes)


def test_mac_of_own_modes_is_one_whatever_their_factor():
    body = reduced(12, block(cells=(6, 1, 1)))
    modes = modes_of(body, [2.0, -1j, 1 + 1j], [0, 1, 2])
    found = modes.mac(body, fixed=("root",), n=3)
    assert_allclose(np.diag(found), 1.0, rtol=1e-12)
    assert found.max() <= 1 + 1e-12
    swapped = modes_of(body, [1.0, 1.0], [2, 0]).mac(body, fixed=("root",), n=4)
    assert_array_equal(swapped.argmax(axis=1), [2, 0])
    a, b = modes.shapes[0].real.ravel(), modes.shapes[1].imag.ravel()
    assert_allclose(found[0, 1], (a @ b) ** 2 / (a @ a) / (b @ b), rtol=1e-10)
    refuses(ConfigError, "elastic modes", modes.mac, body, n=99)
    refuses(ConfigError, "must be finite and not zero", modes_of, body, [1.0, 0.0], [0, 1])


TABLE = """analyser 3 of the laboratory
Frequency [Hz]{s}5+Y/11-Z real [{u}]{s}5+Y/11-Z imag [{u}]{s}9-Z/11-Z magnitude [{u}]{s}\
9-Z/11-Z phase [deg]{s}5+Y/11-Z coherence{s}9-Z/11-Z coherence
"""
POINTS = "node,x [mm],y [mm],z [mm]\n" + "".join(
    f"{n},{1e3 * x},{1e3 * y},{1e3 * z}\n" for n, (x, y, z) in NODES.items()
)


def table(unit="m/s^2/N", factor=1.0, separator=",", comma=False):
    a, b = (H / factor for H in ACCELERANCE)
    columns = [F, a.real, a.imag, abs(b), np.angle(b, deg=True), *COHERENCE]
    lines = [separator.join(f"{x:.10g}" for x in row) for row in np.column_stack(columns)]
    lines = [line.replace(".", ",") if comma else line for line in lines]
    return TABLE.format(s=separator, u=unit) + "\n".join(lines) + "\n"


def read_table(folder, text, points=POINTS):
    (folder / "points.csv").write_text(points)
    more = {"averages": 20, "coherence": None, "points": folder / "points.csv"}
    return read(folder / "test.csv", text, **more)


UNITS = [("m/s^2/N", 1.0), ("(m/s\u00b2)/N", 1.0), ("g/N", 9.80665), ("mm/s^2/N", 1e-3),
         ("g/lbf", 9.80665 / 4.4482216152605), ("in/s^2/kN", 0.0254 / 1e3)]  # fmt: skip


@pytest.mark.parametrize(("unit", "factor"), UNITS)
def test_a_table_of_an_analyser_is_read(unit, factor, tmp_path):
    test = read_table(tmp_path, table(unit, factor))
    same = rom.io.read_responses(HERE / "pyuff_test.uff", averages=20)
    for found, expected in zip(fields(test)[:-1], fields(same)[:-1], strict=True):
        assert_allclose(found, expected, rtol=1e-6)


def test_a_table_with_decimal_commas_and_in_velocities_is_read(tmp_path):
    test = read_table(tmp_path, table(separator=";", comma=True))
    assert_allclose(test.H[:, 0, 0], -ACCELERANCE[0] / (2 * np.pi * F) ** 2, rtol=1e-8)
    test = read_table(tmp_path, table("mm/s/N", 1e-3))
    assert_allclose(test.H[:, 1, 0], ACCELERANCE[1] / (2j * np.pi * F), rtol=1e-8)


@pytest.mark.once
def test_hdf5_brings_the_same_test_back(tmp_path):
    pytest.importorskip("h5py", reason="the file is HDF5")
    test = replace(rom.io.read_responses(HERE / "pyuff_test.uff", averages=20), force_noise=0.05)
    path = rom.io.write_responses(test, tmp_path / "test.h5")
    assert rom.io.read_responses(path).force_noise == 0.05
    for found, expected in zip(*map(fields, (rom.io.read_responses(path), test)), strict=True):
        assert_array_equal(found, expected)
    refuses(ConfigError, "says averages", rom.io.read_responses, path, averages=3)
    refuses(ConfigError, r"written as \.h5", rom.io.write_responses, test, tmp_path / "test.mat")


def two(**second):
    nodes = "".join(
        f"{n:10d}{0:10d}{0:10d}{0:10d}" + f"{n:13.5e}{0:13.5e}{0:13.5e}\n" for n in (7, 8, 11)
    )
    first = f"{-1:6d}\n{15:6d}\n{nodes}{-1:6d}\n" + dataset(6, 1, [RE, IM])
    return first + dataset(6, 1, [RE, IM], **{"response": (8, 1)} | second)


def read(path, text=None, **options):
    if text is not None:
        path.write_text(text)
    return rom.io.read_responses(path, **{"averages": 5, "coherence": 0.9} | options)


def labelled(unit, kind=12):
    head = f"{kind:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} "
    return two().replace(head + f"{'NONE':<20}", head + f"{unit:<20}")


def test_what_a_universal_file_lacks_is_named(tmp_path):
    path = tmp_path / "x.unv"

    def refused(text, words, kind=FileFormatError, **options):
        refuses(kind, words, read, path, text, **options)

    whole = two()
    test = read(path, whole)
    assert test.H.shape == (X.size, 2, 1) and (test.coherence == 0.9).all()
    refused(whole, "averages is missing", ConfigError, averages=None)
    refused(whole, r"no coherence of 7\+Z/11-Z, 8\+X/11-Z", coherence=None)
    refused(two(response=(6, 1)), "nodes without coordinates: 6")
    refused(two(response=(8, 4)), r"function of 8\+4 by 11-Z is no translation")
    refused(two(response=(7, 3)), r"7\+Z/11-Z is there twice")
    refused(two(numerator=13), "13 must be of")
    refused(labelled("V"), "the unit 'V' is no motion.*calibrate")
    refused(labelled("mm"), "numerator needs unit 12, got 'mm'")
    refused(whole.replace(f"{2.0:13.5e}{0.5:13.5e}", f"{2.0:13.5e}{0.6:13.5e}", 1), "other lines")
    units = f"{-1:6d}\n{164:6d}\n{1:10d}{'SI':>20}{1:10d}\n" + 3 * f"{1.0:25.17e}" + f"\n{-1:6d}\n"
    refused(units + labelled("mm/s^2"), "0.001 times that of dataset 164")
    axes = f"{-1:6d}\n{2420:6d}\n{1:10d}\n{-1:6d}\n"
    turned = whole.replace(f"{8:10d}{0:10d}{0:10d}", f"{8:10d}{0:10d}{3:10d}")
    refused(axes + turned, "node 8 is in the local coordinate system 3")
    read(path, axes + whole)  # local axes that no node uses
    refuses(FileFormatError, "no mode", rom.io.read_modes, path)
    refuses(ConfigError, "a test is written as", rom.io.read_responses, "x.mat", averages=3)
    test = rom.io.read_responses(HERE / "pyuff_test.uff", averages=20)
    refuses(ConfigError, "H is real at all lines", replace, test, H=np.abs(test.H))
    data = (HERE / "pyuff_test.uff").read_bytes()
    assert b"58b     1     2" in data
    (tmp_path / "x.uff").write_bytes(data.replace(b"58b     1     2", b"58b     2     2"))
    refuses(FileFormatError, "the order of bytes is not", read, tmp_path / "x.uff", coherence=None)


GLOBAL = (0, 0, 0, 1, 0, 0, 0, 0, 1)  # origin, a point on the x axis, one in the xz plane
SYSTEMS_18 = {  # type, reference and nine numbers of system 3, and whether it is the global one
    "as testers write it": (0, 0, GLOBAL, True),
    "points farther out": (0, 3, (0, 0, 0, 2.5, 0, 0, -1, 0, 4), True),
    "in system 2": (0, 2, GLOBAL, True),
    "in a shifted system": (0, 4, GLOBAL, False),
    "cylindrical": (1, 0, GLOBAL, False),
    "shifted": (0, 0, (0, 0.1, 0, 1, 0.1, 0, 0, 0.1, 1), False),
    "turned about z": (0, 0, (0, 0, 0, 0, 1, 0, 0, 0, 1), False),
    "turned about x": (0, 0, (0, 0, 0, 1, 0, 0, 0, 1, 0), False),
    "upside down": (0, 0, (0, 0, 0, 1, 0, 0, 0, 0, -1), False),
}


def systems(kind, number, shape, reference, values):
    """A system as dataset 18 or 2420 writes it, name included."""
    if kind == 18:
        row = "".join(f"{x:13.5E}" for x in values)
        rows = [f"{number:10d}{shape:10d}{reference:10d}{8:10d}{1:10d}", "HUB", row[:78], row[78:]]
    else:
        rows = [f"{number:10d}{shape:10d}{8:10d}", "HUB"]
        rows += ["".join(f"{x:25.16E}".replace("E", "D") for x in r) for r in values]
    return "\n".join(rows) + "\n"


@pytest.mark.parametrize("case", SYSTEMS_18)
def test_a_coordinate_system_that_is_the_global_one_is_no_obstacle(case, tmp_path):
    """Programs write it beside nodes that they put there; another one is refused by its name."""
    shape, reference, values, same = SYSTEMS_18[case]
    others = systems(18, 2, 0, 0, GLOBAL) + systems(18, 4, 0, 0, (1, 0, 0, 2, 0, 0, 1, 0, 1))
    given = others + systems(18, 3, shape, reference, values)
    for place in (10, 20):  # where a node is given, and where it is measured
        text = f"{8:10d}{0:10d}{0:10d}"
        node = text[:place] + f"{3:10d}" + text[place + 10 :]
        text = f"{-1:6d}\n{18:6d}\n{given}{-1:6d}\n" + two().replace(text, node)
        if same:
            test, plain = read(tmp_path / "x.unv", text), read(tmp_path / "y.unv", two())
            assert_array_equal(test.sensors.points, plain.sensors.points)
            continue
        refuses(FileFormatError, "node 8 .* system 3 HUB", read, tmp_path / "x.unv", text)


@pytest.mark.parametrize(("turned", "same"), [(0.0, True), (1e-3, False)])
def test_a_coordinate_system_of_dataset_2420(turned, same, tmp_path):
    A = np.eye(4, 3)
    A[0, 1] = turned
    given = f"{1:10d}\nPART\n" + systems(2420, 3, 0, 0, A)
    node = two().replace(f"{8:10d}{0:10d}{0:10d}", f"{8:10d}{3:10d}{3:10d}")
    path, text = tmp_path / "x.unv", f"{-1:6d}\n{2420:6d}\n{given}{-1:6d}\n{node}"
    if same:
        read(path, text)
    else:
        refuses(FileFormatError, "node 8 .* system 3 HUB", read, path, text)
    cut = f"{-1:6d}\n{18:6d}\n{3:10d}\n{-1:6d}\n{node}"
    refuses(FileFormatError, "dataset 18 or 2420 is cut", read, path, cut)


def test_pairs_that_were_not_measured_do_not_count(tmp_path):
    test = read(tmp_path / "x.unv", two(reference=(7, 2)))
    assert test.H.shape == (X.size, 2, 2)
    assert_array_equal(test.coherence[0] > 0, [[False, True], [True, False]])
    assert isinstance(test, Responses) and np.isfinite(test.H[:, [0, 1], [1, 0]]).all()


def test_what_a_table_lacks_is_named(tmp_path):
    def refused(text, words, points=POINTS):
        refuses(FileFormatError, words, read_table, tmp_path, text, points)

    whole = table()
    refused(whole.replace("5+Y/11-Z real", "tip real"), "column 2 has the name 'tip real")
    refused(whole.replace("5+Y/11-Z imag [m/s^2/N]", "6+Y/11-Z coherence"), r"there is \['real'\]")
    refused(whole.replace("imag [m/s^2/N]", "imag [g/N]"), "units are")
    refused(whole.replace("[deg]", "[grad]"), "phase has the unit 'grad'")
    refused(whole.replace("m/s^2/N", "V/V"), "is no motion|is no force")
    refused(whole.replace("0.02", "x", 1), "line 8: could not convert")
    refused(whole + "1,2\n", "line 9 has 2 numbers under 7 names")
    refused("a\nb\n", "no column is named")
    refused(whole, "columns .* node, x", POINTS.replace("x [mm]", "x"))


def test_lines_in_other_units_and_texts_in_other_alphabets_are_read(tmp_path):
    whole = table(unit="m/s\u00b2/N", separator=";", comma=True)
    for code in ("cp1252", "utf-16", "utf-8"):
        (tmp_path / "test.csv").write_bytes(whole.encode(code))
        assert_allclose(read_table(tmp_path, None).frequencies, F)
    turning = whole.replace("[Hz]", "[rad/s]")
    assert_allclose(read_table(tmp_path, turning).frequencies, F / (2 * np.pi))
    for new, words in (("[rpm]", "the unit 'rpm' is no frequency"), ("[Hz]", "of thousands")):
        text = whole.replace("[Hz]", new).replace("0,02", "0.02", new == "[Hz]")
        refuses(FileFormatError, words, read_table, tmp_path, text)
    path = tmp_path / "x.unv"
    assert_allclose(read(path, labelled("rad/s", 18)).frequencies, X / (2 * np.pi))
    refuses(FileFormatError, "the unit 'rpm' is no frequency", read, path, labelled("rpm", 18))


def test_bodies_of_an_assembly_are_named_by_entities_or_by_a_table_of_points(tmp_path):
    """Node 7 is on both sides of a joint; ten characters of a name are kept in universal files."""
    of = {"bodies": ("frame", "counterweight")}

    def written(*owners, force="frame"):
        functions = [dataset(6, 1, [RE, IM], entities=(own, force)) for own in owners]
        nodes = two().split(f"{58:6d}")[0].removesuffix(f"{-1:6d}\n")
        (tmp_path / "x.unv").write_text(nodes + "".join(functions))
        return tmp_path / "x.unv"

    test = read(written("FRAME", "counterwei"), **of)
    assert test.sensors.bodies == ("counterweight", "frame") and test.inputs.bodies == ("frame",)
    assert_array_equal(test.sensors.points[0], test.sensors.points[1])
    for wrong, words in (("wing", "node 7 is of 'wing'; bodies are 'frame'"), ("NONE", "no body")):
        refuses(FileFormatError, words, read, written("frame", wrong), **of)
    test = read(written("left", force="left"), **of)
    assert test.sensors.bodies is None
    owners = ("body", "frame", "counterweight", "frame")
    points = zip(POINTS.splitlines(), owners, strict=True)
    test = read_table(tmp_path, table(), "\n".join(f"{line},{own}" for line, own in points))
    assert test.sensors.bodies == owners[1:3] and test.inputs.bodies == ("frame",)
