"""Body, family and state files with right checksums and wrong content: typed errors only."""

import numpy as np
import pytest

import rom
from cases.files.damage import ARCHIVES, outcome, unpacked
from rom.io.archive import write_archive

WRONG = (None, -1, 1e308, "x", [1], {"x": 1}, True)
pytestmark = pytest.mark.filterwarnings("ignore::rom.errors.RomWarning", "ignore::RuntimeWarning")


@pytest.fixture(scope="module", params=ARCHIVES)
def file(request, tmp_path_factory):
    """(path, manifest, arrays, reader)."""
    make, read = ARCHIVES[request.param]
    path = make(tmp_path_factory.mktemp("files"))
    return path, *unpacked(path), read


def leaves(tree, place=()):
    yield place
    inside = {dict: dict.items, list: enumerate}.get(type(tree), lambda _: ())
    for key, value in inside(tree):
        yield from leaves(value, (*place, key))


def changed(tree, place, value):
    if not place:
        return value
    out = tree.copy()
    out[place[0]] = changed(tree[place[0]], place[1:], value)
    return out


def shapes(A):
    yield from (np.zeros(()), np.zeros(0), np.zeros((0, 3)), A[None], A.ravel()[:-1], -A)
    yield np.clip(1e300 * A, -1e300, 1e300)
    yield np.full(A.shape, 7)
    yield np.full(A.shape, -(2**62))


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    monkeypatch.setattr("os.fsync", lambda handle: None)


@pytest.mark.long
def test_a_manifest_with_any_other_value_is_refused_or_harmless(file):
    path, manifest, arrays, read = file
    found = {}
    for place in leaves(manifest):
        if place[:1] in ((), ("provenance",)) or (place[0] == "certificate" and place[2:3] > (0,)):
            continue
        for value in WRONG:
            write_archive(path, changed(manifest, place, value), arrays, "it")
            found[(*place, repr(value))] = outcome(read, path, memory=None)
    for name in ("schema", "version", "memory" if "memory" in manifest else "units"):
        assert found[name, "{'x': 1}"] is not None
    assert sum(error is not None for error in found.values()) > len(found) // 3


@pytest.mark.long
def test_arrays_of_any_other_shape_are_refused_or_harmless(file):
    path, manifest, arrays, read = file
    refused = n = 0
    for name, A in arrays.items():
        for other in shapes(A):
            write_archive(path, manifest, arrays | {name: other}, "it")
            refused, n = refused + (outcome(read, path, memory=None) is not None), n + 1
    assert refused > n // 3 or read is rom.load_state


def test_a_missing_array_is_named(file):
    path, manifest, arrays, read = file
    for name in arrays:
        write_archive(path, manifest, {k: A for k, A in arrays.items() if k != name}, "it")
        assert outcome(read, path, memory=None) is not None or "/" in name
