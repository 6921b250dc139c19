"""The body file: written whole or not at all, read back bit by bit, refused when damaged."""

import io
import json
import zipfile
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import rom
from cases.files.damage import unpacked
from cases.refusals import refuses
from cases.solid import block
from rom.errors import ConfigError, FileFormatError, QualityGateError, RomError, UnsafeFileError
from rom.io.archive import write_archive
from rom.io.files import write_whole


@pytest.fixture(scope="module")
def body():
    model = block(cells=(4, 1, 1), origin=(0.1, 0.2, 0.3))
    kinds = {"root": "rbe2", "tip": "full"}
    return rom.reduce(model, method=rom.CraigBampton(4), interfaces=kinds, reference="root")


@pytest.fixture
def file(body, tmp_path):
    return rom.save(body, tmp_path / "rod.rom.npz")


def test_what_is_read_equals_what_was_written_to_the_byte(body, file, tmp_path):
    K_geo = {"omega_z^2": np.diag(np.arange(1.0, body.n_modes + 1))}
    again = rom.load(rom.save(replace(body, K_geo=K_geo), tmp_path / "b.npz"))
    assert_array_equal(again.K_geo["omega_z^2"], K_geo["omega_z^2"])
    for name in ("mass", "first_moment", "inertia", "S", "Ibar_kl", "S_kl", "K", "D", "omega"):
        assert_array_equal(getattr(again, name), getattr(body, name))
    for name, marker in body.markers.items():
        for part in ("point", "translation", "rotation", "hold"):
            assert_array_equal(getattr(again.marker(name), part), getattr(marker, part))
    assert_array_equal(again.surface.shape, body.surface.shape)
    assert again.certificate == body.certificate
    assert (again.labels, again.reference, again.units) == (body.labels, "root", "SI")
    assert_array_equal(again.frequencies(9), body.frequencies(9))
    assert again.provenance == json.loads(json.dumps(body.provenance))
    assert rom.save(body, tmp_path / "other.npz").read_bytes() == file.read_bytes()


def test_older_versions_are_read_and_newer_ones_named(file, tmp_path):
    """Minor versions only add: what is missing is empty."""
    assert rom.load(rewritten(file, tmp_path / "old.npz", of_version(b"1, 0"))).K_geo == {}
    new = rewritten(file, tmp_path / "new.npz", of_version(b"9, 0"))
    refuses(FileFormatError, r"schema 'rom-body' \[9, 0\]", rom.load, new)


def rewritten(file, path, change):
    """A copy of the file with its members passed through ``change(name, data)``."""
    with zipfile.ZipFile(file) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            data = change(name, old.read(name))
            if data is not None:
                new.writestr(name, data)
    return path


def of_version(numbers):
    return lambda name, data: data.replace(b'"version": [1, 7]', b'"version": [%s]' % numbers)


def npy(array, **options):
    buffer = io.BytesIO()
    np.lib.format.write_array(buffer, array, **options)
    return buffer.getvalue()


TERABYTES = npy(np.zeros((2, 2))).replace(b"(2, 2)", b"(99999999, 99999)")
WRONG_MEMBERS = [
    ("K.npy", None, FileFormatError, "lacks the array .K. of its manifest"),
    ("K.npy D.npy", None, FileFormatError, "'D', 'K' of its manifest"),
    ("manifest.npy", None, FileFormatError, "no manifest"),
    ("manifest.npy", npy(np.zeros(3, np.uint8)), FileFormatError, "manifest cannot be read"),
    ("K.npy", npy(np.array([{}], dtype=object), allow_pickle=True), UnsafeFileError, "type"),
    ("K.npy", npy(np.eye(2, dtype=np.float32)), UnsafeFileError, "type <f4"),
    ("K.npy", npy(np.asfortranarray([[2.0, 0.0], [1.0, 2.0]])), UnsafeFileError, "'K' claims"),
    ("K.npy", npy(np.eye(2)), FileFormatError, "'K' was changed after writing"),
    ("K.npy", npy(np.eye(3))[:-8], FileFormatError, "cut|claims"),
    ("K.npy", b"not an array", FileFormatError, "broken header"),
    ("K.npy", TERABYTES, (UnsafeFileError, FileFormatError), "x.npz"),  # before memory is taken
]


def test_a_wrong_member_is_named(file, tmp_path):
    for members, content, kind, message in WRONG_MEMBERS:
        changes = dict.fromkeys(members.split(), content)
        path = rewritten(file, tmp_path / "x.npz", lambda n, d, c=changes: c.get(n, d))
        refuses(kind, message, rom.load, path)
    refuses(UnsafeFileError, "above the limit of 0", rom.load, file, limit=1000)


def test_a_body_that_is_not_finite_or_not_definite_is_not_passed_on(body, tmp_path):
    nan, path = replace(body, K=body.K * np.nan), tmp_path / "x.npz"
    refuses(QualityGateError, "K of body 'body' must be finite", rom.save, nan, path)
    assert not list(tmp_path.iterdir())
    K = body.K.copy()
    K[0, 1] = K.max()
    for change, message in (
        ({"S_kl": -body.S_kl}, "mass must be positive definite"),
        ({"K": K}, "K is not symmetric"),
        ({"K_geo": {"a_x": np.eye(2)}}, "has the shape"),  # of another body
        ({"K_geo": {"a_x": np.tri(body.n_modes)}}, "is not symmetric"),
    ):
        refuses(RomError, message, rom.load, rom.save(replace(body, **change), path))


def test_a_wrong_place_and_a_full_disk_are_named_and_leave_the_old_file(body, file, tmp_path):
    refuses(ConfigError, "is a folder", rom.save, body, tmp_path)
    refuses(ConfigError, "does not exist", rom.save, body, tmp_path / "nowhere" / "b.npz")
    before = file.read_bytes()

    def fail(_):
        with open("/dev/full", "wb", buffering=0) as full:
            full.write(b"x")

    refuses(rom.ResourceError, "No space left", write_whole, file, fail)
    assert file.read_bytes() == before
    assert [p.name for p in file.parent.iterdir()] == [file.name]


WRONG = (None, -1, 1e308, float("nan"), "nonsense", [1], {"x": 1}, [1, -1])
# a value that fails, by the relation to its limit
FAILED_BY = {"<=": 1e308, ">": -1e308}


def is_noticed(path, manifest, arrays):
    """Whether a file with right checksums is refused, or `rom check` fails."""
    write_archive(path, manifest, arrays, "it")
    try:
        return not rom.check(rom.load(path)).ok
    except RomError:
        return True


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    model = block(cells=(4, 1, 1), origin=(0.1, 0.2, 0.3))
    kinds = {"root": "rbe2", "tip": "rbe3"}
    body = rom.reduce(model, method=rom.CraigBampton(16), interfaces=kinds, reference="root")
    assert rom.check(body).ok
    return unpacked(rom.save(body, tmp_path_factory.mktemp("good") / "x.npz"))


WORDS = ("version", "schema", "units", "name", "reference", "labels", "surface", "provenance",
         "geometric_stiffness", "markers")  # fmt: skip


@pytest.mark.parametrize("field", WORDS)
def test_words_of_a_file_that_are_nonsense_are_refused(good, field, tmp_path, monkeypatch):
    monkeypatch.setattr("os.fsync", lambda handle: None)
    manifest, arrays = good
    for value in WRONG:
        if (field, value) not in (("name", "nonsense"), ("provenance", {"x": 1})):
            assert is_noticed(tmp_path / "x.npz", manifest | {field: value}, arrays), value
    twice = [manifest["markers"][0]] * 2
    assert is_noticed(tmp_path / "x.npz", manifest | {"markers": twice}, arrays)
    rigid = [manifest["markers"][0] | {"kind": "rbe4"}, manifest["markers"][1]]
    assert is_noticed(tmp_path / "x.npz", manifest | {"markers": rigid}, arrays)
    assert not is_noticed(tmp_path / "x.npz", manifest, arrays)


@pytest.mark.parametrize("part", ["quantity", "value", "limit", "ok"])
def test_a_row_of_a_certificate_is_judged_by_its_value(good, part, tmp_path, monkeypatch):
    monkeypatch.setattr("os.fsync", lambda handle: None)
    manifest, arrays = good
    report = manifest["certificate"]
    for k in (0, 1, -1):
        row = report["rows"][k]
        beyond = FAILED_BY.get(row["limit"].split()[0], float("nan"))
        for value in (beyond, float("nan"), "x", True) if part == "value" else WRONG:
            if part == "quantity" and value == "nonsense":
                continue
            rows = report["rows"].copy()
            rows[k] = row | {part: value}
            changed = manifest | {"certificate": report | {"rows": rows}}
            assert is_noticed(tmp_path / "x.npz", changed, arrays), (row, value)


def test_arrays_that_contradict_each_other_are_noticed(good, tmp_path, monkeypatch):
    """Twice the damping or another mass centre is another body; these are none."""
    monkeypatch.setattr("os.fsync", lambda handle: None)
    manifest, arrays = good
    changes = {
        "omega": (lambda A: -A, lambda A: 2 * A, lambda A: A[::-1]),
        "K": (lambda A: -A, lambda A: 2 * A, lambda A: A[::-1]),
        "S_kl": (lambda A: -A, lambda A: 2 * A), "mass": (lambda A: -A, lambda A: 0 * A),
        "first_moment": (lambda A: 1e300 * A, lambda A: 1e3 * A + 1e3),
        "inertia": (lambda A: -A, lambda A: A[::-1]),
        "marker/0/point": (lambda A: 2 * A, lambda A: -A), "marker/0/hold": (lambda A: 2 * A,),
        "marker/1/rotation": (lambda A: 2 * A,), "marker/1/translation": (lambda A: -A,),
        "surface/triangles": (lambda A: A.ravel()[:-1], lambda A: A + 10**6),
    }  # fmt: skip
    for name, ways in changes.items():
        for k, way in enumerate(ways):
            wrong = arrays | {name: way(arrays[name])}
            assert is_noticed(tmp_path / "x.npz", manifest, wrong), (name, k)
