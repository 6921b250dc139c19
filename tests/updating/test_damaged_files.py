"""Files of tests damaged one way after another: each is named, none is taken for whole."""

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.components.updating import assert_right, exact_responses, family_of, model_of
from cases.paths import TESTS
from cases.refusals import refuses
from rom.components.updating.frf_data import noisy
from rom.errors import FileFormatError, RomError, RomWarning
from rom.io.files import h5py
from rom.updating import Channels

HERE = TESTS / "reference" / "foreign"
F = np.linspace(20.0, 700.0, 60)
NODES = {1: (0.5, 0.0, 0.08), 2: (0.75, 0.1, 0.08), 3: (1.0, 0.1, 0.0), 4: (1.0, 0.0, 0.08)}
SENSORS = tuple((node, axis) for node in NODES for axis in "YZ")
FORCE = (3, "Z")
SCALES = {-1.0: "turned around", 1e3: "millimetres", 1e-3: "millimetres", 0.75: "worst sensor"}
SCALES |= {1 / 9.80665: "in g|for g", 9.80665: "in g|for g"}
TRUE = {"inner": 1.2, "outer": 0.9}
AXES = {"Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}


@pytest.fixture(scope="module")
def family():
    return family_of({name: rom.YoungsModulus(name, 0.4, 2.5) for name in TRUE}, (8, 1, 1), 8)


@pytest.fixture(scope="module")
def responses(family):
    """(n_f, n_s) accelerations per force of the true body, with noise of 2 % [m/s^2/N]."""
    channels = [Channels([NODES[n] for n, _ in dofs], [AXES[a] for _, a in dofs])
                for dofs in (SENSORS, [FORCE])]  # fmt: skip
    H = exact_responses(model_of(family, channels, ("root",)), TRUE, F, 0.01)[:, :, 0]
    H = -((2 * np.pi * F[:, None]) ** 2) * H
    return noisy(H, 0.02 * np.sqrt(2), np.random.default_rng(0))


def written(folder, H, *, nodes=None, unit="m/s^2/N", length="m", force=FORCE):
    names = ["Frequency [Hz]"]
    by = f"{force[0]}+{force[1]}"
    for node, axis in SENSORS:
        names += [f"{node}+{axis}/{by} {part} [{unit}]" for part in ("real", "imag")]
    parts = np.stack([H.real, H.imag], axis=2).reshape(len(F), -1)
    lines = [",".join(names)]
    lines += [",".join(f"{x:.10g}" for x in row) for row in np.column_stack([F, parts])]
    points = [f"node,x [{length}],y [{length}],z [{length}]"]
    points += [f"{n},{x},{y},{z}" for n, (x, y, z) in (nodes or NODES).items()]
    (folder / "test.csv").write_text("\n".join(lines) + "\n")
    (folder / "points.csv").write_text("\n".join(points) + "\n")
    return folder


def updated(family, folder, averages=50):
    read = {"coherence": 1 / (1 + 2 * 50 * 0.02**2), "points": folder / "points.csv"}
    test = rom.io.read_responses(folder / "test.csv", averages=averages, **read)
    return rom.update(family, test, fixed=("root",))


def test_a_whole_file_is_updated_and_larger_errors_are_warned_of(family, responses, tmp_path):
    found = updated(family, written(tmp_path, responses))
    assert found.verdict.ok
    assert_right(found, TRUE)
    # of a tenth of the averages chi-square is a tenth, and a wrong model passes more easily
    with pytest.warns(RomWarning, match=r"what is left is 0\.\d+ of the noise"):
        updated(family, tmp_path, averages=5)


DAMAGES = {
    "nodes are in metres": (
        {"length": "mm"}, "times 1000 all 8 of them .*: metres taken for millimetres"),
    "nodes are in millimetres": (
        {"nodes": {n: tuple(1e3 * x for x in p) for n, p in NODES.items()}},
        r"sensor \d at .* times 0\.001 all 8 of them .*: millimetres taken for metres"),
    "nodes are in inches": (
        {"nodes": {n: tuple(x / 0.0254 for x in p) for n, p in NODES.items()}},
        r"times 0\.0254 all 8 .*: inches"),
    "a node is missing": ({"nodes": {1: NODES[1]}}, "without coordinates: 2, 3, 4"),
    "units of the header are wrong": ({"unit": "mm/s^2/N"}, "all responses .*millimetres"),
    "accelerations are said to be displacements": (
        {"unit": "m/N"}, r"\(2 pi f\)\^2: accelerations taken for displacements"),
    "accelerations are said to be velocities": (
        {"unit": "m/s/N"}, r"\(2 pi f\)\^1: an acceleration taken for a velocity"),
    "volts are not calibrated": ({"unit": "V/N"}, "'v' is no motion.*calibrate"),
    "the force is off the body": (
        {"force": (9, "Z"), "nodes": {**NODES, 9: (2.0, 0.0, 0.0)}},
        "input 0 .* off the body"),
}  # fmt: skip


@pytest.mark.parametrize("name", DAMAGES)
def test_what_is_wrong_in_a_table_is_named(family, responses, tmp_path, name):
    more, words = DAMAGES[name]
    refuses(RomError, words, updated, family, written(tmp_path, responses, **more))


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize(("factor", "why"), SCALES.items())
def test_a_sensor_drawn_at_random_is_named(family, responses, tmp_path, factor, why, seed):
    """Ranges from 0.1 to 10 explain a level by themselves: the verdict then says what is wrong."""
    wide = {n: replace(p, low=0.1, high=10.0) for n, p in family.parameters.items()}
    k = int(np.random.default_rng([seed, round(abs(factor) * 1e5)]).integers(len(SENSORS)))
    scales = np.where(np.arange(len(SENSORS)) == k, factor, 1.0)
    folder = written(tmp_path, scales * responses)
    try:
        words = str(updated(replace(family, parameters=wide), folder).verdict)
    except RomError as error:
        words = str(error)
    assert {int(n) for n in re.findall(r"ensors?,? (\d+)", words)} == {k}, words
    assert re.search(why, words), words


def test_a_table_that_is_cut_is_named_at_each_place(responses, tmp_path):
    text = (written(tmp_path, responses) / "test.csv").read_text()
    start = text[:-1].rindex("\n") + 1
    read = {"averages": 50, "coherence": 0.9, "points": tmp_path / "points.csv"}
    for end in range(start + 3, len(text) - 12, 7):
        (tmp_path / "test.csv").write_text(text[:end])
        refuses(FileFormatError, r"line 61", rom.io.read_responses, tmp_path / "test.csv", **read)
    (tmp_path / "test.csv").write_text(text[:start])
    assert len(rom.io.read_responses(tmp_path / "test.csv", **read).frequencies) == len(F) - 1


@pytest.mark.parametrize("name", ["pyuff_test.uff", "sdynpy_test.unv"])
def test_a_universal_file_that_is_cut_is_named_at_each_line(tmp_path, name):
    """Only between data sets it cannot be seen, and what is read is right."""
    lines = (HERE / name).read_bytes().split(b"\n")
    whole = rom.io.read_responses(HERE / name, averages=20)
    path, passed = tmp_path / name, []
    for k in range(len(lines) - 1):
        path.write_bytes(b"\n".join(lines[:k]))
        try:
            test = rom.io.read_responses(path, averages=20)
        except FileFormatError as error:
            assert name in str(error)
            continue
        passed.append(k)
        n = test.H.shape[1]
        assert_allclose(test.H, whole.H[:, :n], rtol=0)
        assert lines[k - 1].endswith(b"    -1")
    assert len(passed) <= 4


def test_numbers_that_are_none_are_named_in_a_universal_file(tmp_path):
    text = (HERE / "sdynpy_test.unv").read_text("ascii").splitlines()
    first = next(k for k, line in enumerate(text) if line.strip() == "58") + 12
    text[first] = "NaN".rjust(20) + text[first][20:]
    (tmp_path / "x.unv").write_text("\n".join(text))
    with pytest.raises(FileFormatError, match=r"not finite at 1 lines, e\.g\. at 2 Hz"):
        rom.io.read_responses(tmp_path / "x.unv", averages=20)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    pytest.importorskip("h5py", reason="the file is HDF5")
    test = rom.io.read_responses(HERE / "pyuff_test.uff", averages=20)
    return rom.io.write_responses(test, tmp_path_factory.mktemp("whole") / "a.h5").read_bytes()


@pytest.mark.once
def test_a_byte_that_is_wrong_anywhere_in_hdf5_is_named(whole, tmp_path):
    """Headers without checksums of their own let such files end the process."""
    path, rng = tmp_path / "x.h5", np.random.default_rng(0)
    path.write_bytes(whole)
    test = rom.io.read_responses(path)
    for k in rng.permutation(len(whole))[:400]:
        data = bytearray(whole)
        data[k] ^= 1 << rng.integers(8)
        path.write_bytes(data)
        try:
            found = rom.io.read_responses(path)
        except FileFormatError as error:
            assert "x.h5" in str(error)
            continue
        assert_allclose(found.H, test.H, rtol=0)  # a byte that nothing lies in
        assert_allclose(found.sensors.points, test.sensors.points, rtol=0)
        assert (found.averages, found.quantity) == (test.averages, test.quantity)
    for k in range(0, len(whole), 97):
        path.write_bytes(whole[:k])
        refuses(FileFormatError, r"x\.h5", rom.io.read_responses, path)


CHANGES = {
    "no data set 'H'": lambda file: file.__delitem__("H"),
    "no attribute 'averages'": lambda file: file.attrs.__delitem__("averages"),
    "averages = .* is no number": lambda file: file.attrs.__setitem__("averages", [1, 2]),
    "averages = nan": lambda file: file.attrs.__setitem__("averages", np.nan),
    "averages = 2.5 is no whole number": lambda file: file.attrs.__setitem__("averages", 2.5),
    "force_noise = a is no number": lambda file: file.attrs.__setitem__("force_noise", "a"),
    "units are 'mm'": lambda file: file.attrs.__setitem__("units", "mm"),
    "not those of its checksum": lambda file: file["H"].__setitem__((0, 0, 0), 1.0),
    "'frequencies' holds no real": lambda file: other(file, "frequencies", [1j, 2j]),
    "'H' holds no complex numbers": lambda file: other(file, "H", np.bytes_("H")),
    r"H is \(6, 2, 1\), needed are": lambda file: other(file, "frequencies", [1.0, 2.0], True),
    "quantity": lambda file: file.attrs.__setitem__("quantity", "force"),
}


def other(file, name, value, without_checksum=False):
    del file[name]
    file[name] = value
    if without_checksum:
        del file.attrs["checksum"]


@pytest.mark.once
@pytest.mark.parametrize("words", CHANGES)
def test_what_is_wrong_in_hdf5_is_named(words, whole, tmp_path):
    path = tmp_path / "x.h5"
    path.write_bytes(whole)
    with h5py("").File(path, "r+") as file:
        CHANGES[words](file)
    refuses(FileFormatError, words, rom.io.read_responses, path)


@pytest.mark.once
def test_hdf5_of_another_program_is_read(whole, tmp_path):
    path, there = tmp_path / "x.h5", tmp_path / "whole.h5"
    there.write_bytes(whole)
    test = rom.io.read_responses(there)
    open_file = h5py("").File
    with open_file(there, "r") as file, open_file(path, "w") as new:
        for name in ("frequencies", "H", "coherence", "sensors", "inputs"):
            file.copy(name, new)
        new.attrs.update({"averages": 20, "quantity": "displacement", "units": "SI"})
    found = rom.io.read_responses(path)
    assert_allclose(found.H, test.H, rtol=0)
    assert found.quantity == "displacement" and found.averages == 20
