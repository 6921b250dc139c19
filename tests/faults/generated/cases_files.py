"""Command lines and files of all kinds: wrong by hand, by table and at random."""

import io
import zipfile

import numpy as np
from scipy.sparse import identity

import rom
from generated.case import Works, case, edit, write
from generated.stock import MATRICES, model
from rom.errors import ConfigError, FileFormatError, InterfaceError, MaterialError, ModelError

READ = (FileFormatError, rom.QualityGateError, rom.UnsafeFileError, ModelError)
BODY, STATE, FAMILY, SID = "good.npz", "good.state.npz", "family.npz", "good.SID_FEM"
READERS = {BODY: rom.load, STATE: rom.load_state, FAMILY: rom.load, SID: rom.read_sid}
DECKS = {  # of the nodes
    "no nodes": ("*NODE", "*NOTE", "deck.inp"),
    "a label twice": ("\n2, ", "\n1, ", "1"),
    "a label of zero": ("\n2, ", "\n0, ", ("deck.inp", "root")),
    "a label with a point": ("\n2, ", "\n2.5, ", "deck.inp"),
    "a word for a place": ("\n2, ", "\n2, x, ", "deck.inp"),
    "a place of nan": ("\n2, ", "\n2, nan, ", "deck.inp"),
    "a set without a name": ("*NSET, NSET=tip", "*NSET", ("tip", "deck.inp")),
    "a node less": ("\n12, 1.0, 0.1, 0.08", "", ("deck.inp", "12", "K.mtx")),
}
LINE = f"reduce {MATRICES} -o a.npz"
FOREIGN = (*READ, ConfigError, InterfaceError)
MECHANISM = {  # what stands in pendulum.toml, what instead, and what is named
    "a date for a number": ('mass = "2 kg"', "mass = 2020-01-01", "mass"),
    "a huge whole number": ('mass = "2 kg"', "mass = 1" + 400 * "0", "mass"),
    "an open quote": ('kind = "revolute"', 'kind = "revolute', "pendulum.toml:11"),
    "a body twice in a joint": ("{ ground = [0, 0, 0] }", '"bob.top"', ("bob", "pivot")),
    "half an order": ('dt = "0.5 ms"', 'dt = 0.01\nmethod = "bdf"\norder = 2.5', "order"),
    "an order of nine": ('dt = "0.5 ms"', 'dt = 0.01\nmethod = "bdf"\norder = 9', "order"),
    "a truth as text": ('dt = "0.5 ms"', 'dt = 0.01\nstabilised = "yes"', "stabilised"),
    "two markers that are not there": (
        '{ ground = [0, 0, 0] }, "bob.top"', '"bob.pm", "bob.pn"', "'pm'", "'pn'"),
}  # fmt: skip
COMPONENT = {  # the same of part.toml
    "a stiffness that is not there": ('"K.mtx"', '"nope.mtx"', "nope.mtx"),
    "nodes that are not there": ('"deck.inp"', '"nope.inp"', "nope.inp"),
    "the mass for the nodes": ('"deck.inp"', '"M.mtx"', ("M.mtx", ".mtx")),
    "an interface without nodes": ('root = "rbe2"', 'rot = "rbe2"', "rot"),
    "more modes than dofs": ("modes = 4", "modes = 400", ("400", "modes")),
    "an unknown frame": ('reference = "root"', 'reference = "rot"', "rot"),
    "a folder for a matrix": ('"K.mtx"', '"."', "."),
}
LINES = {  # command lines of which one thing is wrong
    "polynomials of no order": (LINE.replace("rbe2", "polynomial:x", 1), "polynomial"),
    "a set backwards": (f"{LINE} --set root=4-1", "4-1"),
    "Rayleigh's nan": (f"{LINE} --rayleigh nan,0", ("rayleigh", "alpha")),
    "an unknown material": ("swing box.msh --hinge root --material wood -o out", "wood"),
    "a parent that is a file": ("export good.npz good.npz/x.vtu", BODY),
    "no number for a parameter": ("mesh box.geo -p lc=small", "lc"),
    "nan for a parameter": ("mesh box.geo -p lc=nan", "lc"),
    "a parameter without a name": ("mesh box.geo -p =1", "=1"),
    "code for a parameter": ("""mesh box.geo -p 'lc=1;SystemCall "touch pwned";'""", "lc"),
    "code in a name": ("""mesh box.geo -p 'lc=1;SystemCall"touch pwned";//=1'""", "lc"),
}
ANY = (ConfigError, ModelError, InterfaceError, FileFormatError, MaterialError, rom.ParameterError)
BYTES = {  # whole documents
    "empty": (b"", "bodies"),
    "UTF-16": ("name = 'a'".encode("utf-16"), "pendulum.toml"),
    "JSON": (b'{"bodies": {}}', "pendulum.toml"),
    "a mark of the byte order": (b"\xef\xbb\xbfname = 1", ("pendulum.toml", "name")),
    "deep brackets": (b"a = " + b"[" * 10000 + b"]" * 10000, "brackets"),
    "deep keys": (b"a" + b".a" * 400_000 + b" = 1", ("pendulum.toml", "a.a")),
    "a line of a megabyte": (b"name = '" + b"x" * 999_000 + b"'", ("bodies", "name")),
    "more than a megabyte": (b"#" * 50_000_000, "bytes"),
    "ten thousand bodies": (b"".join(b"[bodies.a%d]\n" % k for k in range(10_000)), "mass"),
}


def stored(member, data=None):
    """A member of another name in the body file."""

    def prepare(folder):
        with zipfile.ZipFile(folder / BODY, "a") as archive:
            archive.writestr(member, data or archive.read("K.npy"))

    return prepare


PICKLED = io.BytesIO()
np.save(PICKLED, np.array([{"a": 1}], dtype=object))
CASES = [
    *(case(f"a member named {member}", f"check {BODY}", READ, BODY, given=stored(member))
      for member in ("../pwned.npy", "/nowhere/pwned.npy", "a\\b.npy")),
    case("a pickle that nothing names", f"check {BODY}", Works, given=stored("extra.npy", PICKLED.getvalue())),
    case("two sets that are not there", LINE.replace("root", "rot").replace("tip", "tipp"), FOREIGN,
         "rot", "tipp"),
    case("two parameters that are not there", lambda folder: rom.load(FAMILY).at(rhoo=1, E=2),
         rom.ParameterError, "rhoo", "E"),
    *(case(f"a parameter of {value!r}", lambda folder, x=value: rom.load(folder / FAMILY).at(rho=x), ANY,
           "rho") for value in ("five", np.nan, np.inf, [1.0, 2.0], 1j, {})),
    case("a mass that does not fit",
         lambda folder: rom.craig_bampton(model().K, identity(3, format="csr"), list(range(12)), 2),
         (*ANY, rom.QualityGateError), "36"),
    *(case(f"a mechanism: {name}", "simulate pendulum.toml -o out", ANY, *words,
           given=edit("pendulum.toml", old, new)) for name, (old, new, *words) in MECHANISM.items()),
    *(case(f"a component: {name}", "reduce part.toml -o a.npz", ANY, *words,
           given=edit("part.toml", old, new)) for name, (old, new, *words) in COMPONENT.items()),
    *(case(f"a line: {name}", line, ConfigError, *words, fe=".geo" in line)
      for name, (line, *words) in LINES.items()),
    *(case(f"a document: {name}", "simulate pendulum.toml -o out",
           (ConfigError, FileFormatError, rom.UnsafeFileError), *words, given=write("pendulum.toml", data))
      for name, (data, *words) in BYTES.items()),
    *(case(f"{a} read as {b}", lambda folder, a=a, b=b: READERS[b](folder / a), (*READ, ConfigError), a)
      for a in READERS for b in READERS if READERS[a] is not READERS[b]),
    *(case(f"a deck: {name}", LINE, FOREIGN, word, given=edit("deck.inp", old, new))
      for name, (old, new, word) in DECKS.items()),
    case("a mass as stiffness", LINE.replace("K.mtx --mass M.mtx", "M.mtx --mass K.mtx"), FOREIGN,
         ("mass", "K.mtx", "M.mtx")),
]  # fmt: skip
