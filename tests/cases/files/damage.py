"""Damage to files: what a reader must refuse by name, or read without harm."""

import json
import re
import tracemalloc

import numpy as np
import pytest

import rom
from cases.solid import KINDS, block
from rom.mbs.results.state import Memory, State

NUMBER = re.compile(rb"[-+]?\d+(\.\d*)?([EDed][-+]?\d+)?")
HOSTILE = (b"-1", b"0", b"1e999", b"nan", b"99999999", b"999999999999999999999", b"1_0", b"0x7",
           b"-", b"\xb2", b"2147483648", b"1.5", b"1" * 5000)  # fmt: skip
MEMORY = 32e6  # bytes that reading a file of some kilobytes may take


def flipped(data, rng):
    """One to three bits turned."""
    out = bytearray(data)
    for at in rng.integers(0, len(out), rng.integers(1, 4)):
        out[at] ^= 1 << rng.integers(0, 8)
    return bytes(out)


def cut(data, rng):
    """The beginning of it, at least a byte."""
    return data[: rng.integers(1, len(data))]


def grown(data, rng):
    """Some bytes put in."""
    at = rng.integers(0, len(data))
    return data[:at] + rng.bytes(rng.integers(1, 9)) + data[at:]


def shuffled(data, rng):
    """A line left out, doubled, or emptied."""
    lines = data.splitlines(keepends=True)
    at = rng.integers(0, len(lines))
    lines[at : at + 1] = ([], 2 * lines[at : at + 1], [b"\n"])[rng.integers(0, 3)]
    return b"".join(lines)


def misnumbered(data, rng):
    """A number replaced by one that is no size, no label and no value; early ones more often."""
    places = list(NUMBER.finditer(data))
    if not places:
        return data[:-1]
    found = places[min(int(rng.exponential(0.1) * len(places)), len(places) - 1)]
    return data[: found.start()] + HOSTILE[rng.integers(len(HOSTILE))] + data[found.end() :]


WAYS = (flipped, cut, grown, shuffled, misnumbered)


def changed(text, name, read, *rows, error=rom.FileFormatError):
    """A test that a file is refused by its name when a part of its text is another one.

    Rows are the part, what stands in its first place, the class unless it is that of all, and what
    the message must match; the text may be a function that gives it.
    """

    @pytest.mark.parametrize("row", rows)
    def test(row, tmp_path):
        old, new, *kind, words = row
        whole = text() if callable(text) else text
        assert old in whole
        (tmp_path / name).write_text(whole.replace(old, new, 1))
        with pytest.raises(*kind or [error], match=f"(?s){name}.*{words}"):
            read(tmp_path / name)

    return test


def unpacked(path):
    """Manifest without its checksums, and arrays of a file."""
    with np.load(path) as found:
        arrays = {name: found[name] for name in found.files}
    manifest = json.loads(arrays.pop("manifest").tobytes())
    del manifest["sha256"]
    return manifest, arrays


def damaged(data, rng, n, ways=WAYS):
    """n times (way, bytes), each way as often as the others."""
    for k in range(n):
        way = ways[k % len(ways)]
        yield way, way(data, rng)


def outcome(read, path, memory=MEMORY):
    """The RomError of reading a small file, or None; other errors and much memory end the test."""
    if memory:
        tracemalloc.start()
    try:
        read(path)
    except rom.RomError as error:
        assert str(path.parent) in str(error) and error.message, error
        assert error.exit_code in (2, 3, 4, 5), error
        return error
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        if peak > (memory or np.inf):
            pytest.fail(f"{path}: reading took {peak / 1e6:.0f} MB")
    return None


def body(folder):
    made = rom.reduce(block(cells=(2, 1, 1)), method=rom.CraigBampton(1), interfaces=KINDS)
    return rom.save(made, folder / "x.rom.npz")


def family(folder):
    made = rom.reduce_parametric(
        block(cells=(2, 1, 1)), parameters={"rho": rom.Density(None, 0.5, 2.0)}, tol=0.5,
        method=rom.CraigBampton(1), interfaces=KINDS, damping=rom.Rayleigh(0.0, 1e-6),
    )  # fmt: skip
    return rom.save(made, folder / "x.rom.npz")


def state(folder):
    rng = np.random.default_rng(1)
    q, v, a, lam = (rng.normal(size=n) for n in (7, 6, 6, 5))
    memory = Memory("generalized-alpha", 1e-2, 0.0, 3, {"a": a})
    return rom.save_state(State(t=0.3, rank=5, q=q, v=v, a=a, lam=lam, memory=memory),
                          folder / "x.state.npz")  # fmt: skip


ARCHIVES = {  # what makes a small file of each kind, and what reads it
    "body": (body, rom.load),
    "family": (family, rom.load),
    "state": (state, rom.load_state),
}
