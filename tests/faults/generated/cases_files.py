"""Body, state, family, matrix and SID files: damaged by hand, by table and at random."""

import json

import numpy as np
from damage import HOSTILE, WAYS

import rom
from generated.case import Silent, Warned, case, edit, write
from rom.errors import (
    ConfigError,
    FileFormatError,
    InterfaceError,
    ModelError,
    QualityGateError,
    UnsafeFileError,
)
from rom.io.archive import write_archive
from rom.io.sid_dialect import read_sid

READ = (FileFormatError, QualityGateError, UnsafeFileError, ModelError)
BODY, STATE, FAMILY, SID = "good.npz", "good.state.npz", "family.npz", "good.SID_FEM"
SHARES = (0.0, 0.02, 0.5, 0.99)
MANIFEST = {  # an entry of the manifest of a body, and what it is instead
    "schema": ("rom-boddy", 7, None),
    "version": ([99, 0], "1", [], None, [-1, 0]),
    "units": ("inch", 7, None),
    "markers": (7, [{}], [{"name": "root"}]),
    "labels": (7, [], None),
    "surface": (7, None),
    "certificate": (7, {"title": 1}, []),
    "reference": (7, [1]),
    "name": (7, None, [1]),
}
ARRAYS = {  # what is done to an array of a body
    "not a number": lambda A: A * np.nan,
    "infinite": lambda A: A + np.inf,
    "longer": lambda A: np.concatenate([A, A]),
    "shorter": lambda A: A[:-1],
    "flat": lambda A: A.ravel(),
    "complex": lambda A: A + 1j,
    "text": lambda A: A.astype(str),
    "asymmetric": lambda A: A + np.triu(np.ones(A.shape), 1) * np.abs(A).max(),
}
READERS = {  # a file, how it is read, and how it is damaged
    BODY: rom.load, STATE: rom.load_state, FAMILY: rom.load, SID: read_sid,
}  # fmt: skip
MATRICES = {  # the line of the market file that is changed
    "another banner": ("%%MatrixMarket", "%%MatrixShop"),
    "a complex field": ("real", "complex"),
    "an unknown symmetry": ("symmetric", "diagonal"),
    "an array that is sparse": ("coordinate", "array"),
    "more rows": ("36 36", "37 36"),
    "a huge matrix": ("36 36", "99999999999 99999999999"),
    "negative rows": ("36 36", "-36 36"),
    "a row beyond the end": ("\n1 1 ", "\n99 1 "),
    "a row of zero": ("\n1 1 ", "\n0 1 "),
    "a word": ("\n1 1 ", "\n1 one "),
    "not a number": ("\n1 1 ", "\n1 1 nan "),
    "an infinite value": ("\n1 1 ", "\n1 1 1e999 "),
}
DECKS = {  # of the nodes
    "no nodes": ("*NODE", "*NOTE", "deck.inp"),
    "a label twice": ("\n2, ", "\n1, ", "1"),
    "a label of zero": ("\n2, ", "\n0, ", ("deck.inp", "root")),
    "a label with a point": ("\n2, ", "\n2.5, ", "deck.inp"),
    "a word for a place": ("\n2, ", "\n2, x, ", "deck.inp"),
    "a place of nan": ("\n2, ", "\n2, nan, ", "deck.inp"),
    "a set of no node": ("*NSET, NSET=tip\n", "*NSET, NSET=tip\n99, ", "99"),
    "a set without a name": ("*NSET, NSET=tip", "*NSET", ("tip", "deck.inp")),
    "no set": ("NSET=tip", "NSET=top", "tip"),
    "an include of itself": (
        "*NSET, NSET=tip",
        "*INCLUDE, INPUT=deck.inp\n*NSET, NSET=tip",
        "deck.inp",
    ),
    "an include that is not there": (
        "*NSET, NSET=tip",
        "*INCLUDE, INPUT=nope.inp\n*NSET, NSET=tip",
        "nope.inp",
    ),
    "a node less": ("\n12, 1.0, 0.1, 0.08", "", ("deck.inp", "12", "K.mtx")),
}
NASTRAN = (
    "reduce both.{0}:KAA --mass both.{0}:MAA --nodes nodes.csv --set root=1-4 -i root=rbe2 -o a.npz"
)
LINE = "reduce K.mtx --mass M.mtx --nodes deck.inp -i root=rbe2 -i tip=rbe2 --no-certificate -m 4 -o a.npz"
FOREIGN = (*READ, ConfigError, InterfaceError)


def cut(name, share):
    def prepare(folder):
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(data[: int(share * len(data))])

    return prepare


def mutated(name, k):
    """Damaged at random, in the way of this number."""

    def prepare(folder):
        data = (folder / name).read_bytes()
        (folder / name).write_bytes(WAYS[k % len(WAYS)](data, np.random.default_rng(k)))

    return prepare


def repacked(change):
    """The body file with another manifest or other arrays, and right checksums."""

    def prepare(folder):
        with np.load(folder / BODY) as found:
            arrays = {name: found[name] for name in found.files}
        manifest = json.loads(arrays.pop("manifest").tobytes())
        del manifest["sha256"]
        change(manifest, arrays)
        write_archive(folder / BODY, manifest, arrays, "it")

    return prepare


def entry(name, value):
    return repacked(lambda manifest, arrays: manifest.update({name: value}))


def array(name, f):
    return repacked(lambda manifest, arrays: arrays.update({name: f(arrays[name])}))


def raw(name, f):
    """An array changed behind the back of the checksums, as by another program."""

    def prepare(folder):
        with np.load(folder / BODY) as found:
            arrays = dict(found)
        arrays[name] = f(arrays[name])
        np.savez(folder / BODY, **arrays)

    return prepare


def reading(name):
    return lambda folder: READERS[name](folder / name)


def numbered(name, old, value):
    """A number of a text file replaced by one of the hostile ones."""

    def prepare(folder):
        data = (folder / name).read_bytes()
        assert old in data
        (folder / name).write_bytes(data.replace(old, value, 1))

    return prepare


CASES = [
    *(case(f"{name} instead of another: {k}", reading(name), READ, name, given=write(name, data))
      for name in READERS for k, data in {"nothing": b"", "text": b"hello\n", "zeros": b"\0" * 99}.items()),
    *(case(f"{share:.0%} of {name}", reading(name), READ, name, given=cut(name, share))
      for name in READERS for share in SHARES),
    *(case(f"damaged {name}, {k}", reading(name), (*READ, ConfigError, Silent, Warned), name,
           given=mutated(name, k)) for name in READERS for k in range(10)),
    *(case(f"{a} read as {b}", lambda folder, a=a, b=b: READERS[b](folder / a), (*READ, ConfigError), a)
      for a in READERS for b in READERS if READERS[a] is not READERS[b]),
    *(case(f"{name} = {value!r} in a body", f"check {BODY}", READ, BODY, given=entry(name, value))
      for name, values in MANIFEST.items() for value in values),
    *(case(f"{name} of a body {what}", f"check {BODY}", READ, BODY, given=raw(name, f))
      for what, f in ARRAYS.items() for name in ("K", "inertia", "first_moment")
      if not (what in ("flat", "asymmetric") and name == "first_moment")),
    *(case(f"{name} of a body {what}, with its checksum", f"check {BODY}", (*READ, ConfigError), ("good.npz", name),
           given=array(name, ARRAYS[what])) for what in ("longer", "shorter", "asymmetric")
      for name in ("K", "inertia")),
    *(case(f"a matrix: {name}", LINE, FOREIGN, "K.mtx", given=edit("K.mtx", *texts))
      for name, texts in MATRICES.items()),
    *(case(f"a deck: {name}", LINE, FOREIGN, word, given=edit("deck.inp", old, new))
      for name, (old, new, word) in DECKS.items()),
    *(case(f"{form}: {name}", NASTRAN.format(form), FOREIGN, *words, given=given)
      for form in ("op4", "dmig") for name, given, *words in (
          ("nothing", write(f"both.{form}", ""), f"both.{form}"),
          ("text", write(f"both.{form}", "hello\n"), f"both.{form}"),
          ("half", cut(f"both.{form}", 0.3), f"both.{form}"),
          ("all but the last", cut(f"both.{form}", 0.995), f"both.{form}"),
          ("another name", edit(f"both.{form}", "KAA", "KXX"), ("KAA", "KXX")),
      )),
    *(case(f"a matrix with a size of {value[:12].decode('latin1')}", LINE, (*FOREIGN, Silent, Warned), "K.mtx",
           given=numbered("K.mtx", b"36 36", b"36 " + value)) for value in HOSTILE),
    case("a matrix of no name", NASTRAN.format("op4").replace(":KAA", ""), FOREIGN, ("KAA", "MAA")),
    case("a mass as stiffness", LINE.replace("K.mtx --mass M.mtx", "M.mtx --mass K.mtx"), FOREIGN,
         ("mass", "K.mtx", "M.mtx")),
    case("a body with a name that no file has", f"check {'x' * 300}.npz", FileFormatError, "xxx.npz"),
    case("a body with a zero byte in its name", lambda folder: rom.load("a\0b.npz"), ConfigError,
         ("a\\x00b", "a\0b")),
    case("a device", "check /dev/zero", FileFormatError, "/dev/zero"),
    case("a circle of links", "check loop.npz", FileFormatError, "loop.npz",
         given=lambda folder: (folder / "loop.npz").symlink_to("loop.npz")),
    case("a link to nothing", "check link.npz", FileFormatError, "link.npz",
         given=lambda folder: (folder / "link.npz").symlink_to("nope.npz")),
]  # fmt: skip
