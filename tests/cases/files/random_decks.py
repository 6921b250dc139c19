"""Decks of a box, written in one of the many legal ways, some with a card that nobody reads.

The box lies in a turned and moved place. What is written are coordinates in systems that lead back
to it, so a reader has the volume and the centre of `place` only if it follows all of them.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from cases.files.cells import solid

SIZE = (0.4, 0.05, 0.03)
# that would be lost, by the name they are to be refused with
CARDS = {
    card.partition(",")[0]: card
    for card in """
CBUSH1D,905,7,1,2 CELAS3,906,7,1,2 CELAS4,906,1.+5,1,2 NSM,3,PSOLID,1,2.
MPC,5,1,1,1.,2,1,-1. PSHELL,7,1,.01,1 CBEAM,9,7,1,2,0.,0.,1. PBAR,7,1,1.-4
CPENTA,99,1,1,2,3,4,5,6 CORD3G,9,E313,EQN,1,2,3 =,*(1),=,*(.1),== CTRIAR,99,7,1,2,3
BGSET,1,1,2,2
""".split()
} | {
    "RBE2 of the components 12": "RBE2,901,1,12,2,3",
    "RBE3 averaging the components 123456": "RBE3,902,,1,123456,1.,123456,2",
    "RBE3 of the components 123": "RBE3,902,,1,123,1.,123,2",
    "RBE3 with UM": "RBE3,902,,1,123456,1.,123,2,UM",
    "RBAR of which no end leads": "RBAR,9,1,2,123",
}
KEYWORDS = {
    "*EQUATION": "*EQUATION\n2\n1,1,1.,2,1,-1.",
    "*MPC, LINK": "*MPC\nLINK, 1, 2",
    "*COUPLING that says no kind": "*COUPLING, CONSTRAINT NAME=c, REF NODE=1, SURFACE=s",
    "*KINEMATIC without *COUPLING": "*KINEMATIC",
    "*KINEMATIC of the components 12": "*COUPLING, REF NODE=1, SURFACE=s\n*KINEMATIC\n1, 2",
    "*DISTRIBUTING of the components 123": "*COUPLING, REF NODE=1, SURFACE=s\n*DISTRIBUTING\n1, 3",
    "*DISTRIBUTING, WEIGHTING METHOD=LINEAR": "*COUPLING, REF NODE=1, SURFACE=s\n"
    "*DISTRIBUTING, WEIGHTING METHOD=LINEAR",
    "*RIGID BODY, POSITION": "*RIGID BODY, NSET=root, REF NODE=1, POSITION=CENTER OF MASS",
    "*TIE": "*TIE, NAME=t\na, b",
    "*NONSTRUCTURAL MASS": "*NONSTRUCTURAL MASS, ELSET=e, UNITS=TOTAL MASS\n2.",
    "*MASS, ALPHA": "*MASS, ELSET=e, ALPHA=.1\n2.",
    "*ELEMENT, TYPE=SPRING1": "*ELEMENT, TYPE=SPRING1, ELSET=e\n999, 1",
    "*NGEN": "*NGEN\n1, 9, 2",
    "*NFILL": "*NFILL\na, b, 3, 100",
    "*NCOPY": "*NCOPY, OLD SET=a,\nSHIFT",
    "*ELCOPY": "*ELCOPY, OLD SET=e, SHIFT NODES=100",
    "*SHELL SECTION": "*SHELL SECTION, ELSET=e\n.01",
    "*ELEMENT, TYPE=B31": "*ELEMENT, TYPE=B31\n999, 1, 2",
    "*SPRING, NONLINEAR": "*SPRING, ELSET=e, NONLINEAR\n1\n1.e5, 0.",
    "*ELEMENT, TYPE=C3D6": "*ELEMENT, TYPE=C3D6\n999, 1, 2, 3, 4, 5, 6",
    "*NODE, SYSTEM=S": "*NODE, SYSTEM=S\n9999, 1., 20., 30.",
    "*NSET, ELSET": "*NSET, NSET=x, ELSET=e",
    "*MODEL CHANGE": "*STEP\n*STATIC\n*MODEL CHANGE, REMOVE\ne\n*END STEP",
}
HARMLESS = {
    "bdf": (
        "FORCE,3,1,0,1.,0.,0.,1. EIGRL,1,,,10 PARAM,POST,-1 PLOAD4,3,1,1.+5 PLOTEL,1,1,2 "
        "MAT1,1,2.1+11,,.3,7850. TEMPD,1,20. SUPORT,1,123456 ASET1,123,1"
    ).split(),
    "inp": (
        "*HEADING\n a bar, *not a keyword",
        "*STEP\n*FREQUENCY\n10\n*BOUNDARY\n1, 1, 3\n*END STEP",
        "*BOUNDARY\n1, 1, 3",
        "*AMPLITUDE, NAME=a\n0., 0., 1., 1.",
        "** 1, 2, 3",
        "*MATERIAL, NAME=steel\n*ELASTIC\n 210e9, .3\n*DENSITY\n 7850.,",
    ),
}


@dataclass
class Deck:
    """Files by name, the first is the deck; name of the card to be refused, or ""; the place."""

    files: dict[str, str]
    refused: str
    origin: np.ndarray
    turn: np.ndarray
    kind: str
    n_cells: int
    digits: int


def frame(rng):
    """A rotation, z and x from two random directions."""
    z, x = rng.normal(size=(2, 3))
    z /= np.linalg.norm(z)
    x -= (x @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def inside(points, origin, axes, kind):
    """Coordinates in a system of positions in the basic one."""
    x = (points - origin) @ axes
    r = np.hypot(x[:, 0], x[:, 1])
    around = np.degrees(np.arctan2(x[:, 1], x[:, 0]))
    if kind == "C":
        return np.column_stack([r, around, x[:, 2]])
    if kind == "S":
        length = np.linalg.norm(x, axis=1)
        return np.column_stack([length, np.degrees(np.arctan2(r, x[:, 2])), around])
    return x


def on_axes(origin, axes):
    """Origin, a point on z and one in the plane of z and x."""
    return np.array([origin, origin + 2 * axes[:, 2], origin + 0.7 * axes[:, 0] + 0.4 * axes[:, 2]])


def random_deck(seed, form):
    """The deck of a seed, "bdf" or "inp"; four of ten have a card that is to be refused."""
    rng = np.random.default_rng([seed, form == "inp"])
    mesh = solid(str(rng.choice(["hex8", "hex8", "tet4"])), tuple(rng.integers(1, 4, 3)), SIZE)
    origin, turn = rng.uniform(-0.5, 0.5, 3), frame(rng)
    points, kind = origin + mesh.points @ turn.T, mesh.cell_type
    root = np.flatnonzero(np.abs(mesh.points[:, 0]) < 1e-9)
    writer = (Bulk if form == "bdf" else Keywords)(rng, points, mesh.cells, root, kind)
    refused = rng.random() < 0.4
    table = CARDS if form == "bdf" else KEYWORDS
    name = str(rng.choice(list(table))) if refused else ""
    extra = [str(card) for card in rng.choice(HARMLESS[form], 2, replace=False)]
    files = writer.write([*extra, *([table[name]] if refused else [])])
    return Deck(files, name, origin, turn, kind, len(mesh.cells), writer.digits)


class Bulk:
    """Nastran bulk data."""

    def __init__(self, rng, points, cells, root, kind):
        self.rng, self.points, self.cells, self.root, self.kind = rng, points, cells, root, kind
        self.form = rng.choice(["small", "wide", "free"])
        self.digits = 5 if self.form == "small" else 10
        self.mark = "*" if self.form == "wide" else str(rng.choice(["+", ""]))  # of further lines
        self.small = rng.random() < 0.3  # letters

    def number(self, value):
        if isinstance(value, str | int | np.integer):
            return str(value)
        if abs(value) < 1e-13 and self.rng.random() < 0.5:
            return ""
        text = f"{value:.{self.digits}g}"
        if abs(value) < 0.1:  # without the letter of the exponent
            text = f"{value:.{self.digits - 2}e}".replace("e-0", "-").replace("e-", "-")
            text = text.replace("e+00", "+0")
        elif "." not in text:
            text += "."
        return text.replace("-0.", "-.", 1)

    def card(self, name, *fields):
        words = [self.number(f) for f in fields]
        while not words[-1]:
            words.pop()
        wide = self.form == "wide"
        n = 4 if wide else 8
        rows = [words[k : k + n] for k in range(0, len(words), n)]
        if wide and len(rows) % 2:
            rows.append([])  # wide cards have an even number of lines
        heads = [name + "*" * wide] + [self.mark] * (len(rows) - 1)
        if self.form == "free":
            lines = [",".join([head, *row]) for head, row in zip(heads, rows, strict=True)]
        else:
            width = 16 if wide else 8
            lines = [f"{head:<8}" + "".join(f"{word:>{width}}" for word in row)
                     for head, row in zip(heads, rows, strict=True)]  # fmt: skip
        text = "\n".join(line.rstrip() for line in lines)
        return text.lower() if self.small else text

    def system(self, number, kind, corners, rid=0):
        return self.card(f"CORD2{kind}", number, rid, *corners.ravel())

    def write(self, extra):
        rng, kind = self.rng, self.rng.choice(["", "R", "C", "S"])
        x, head, number, extra_points = self.points, [], 0, []
        way = rng.choice(["own", "default", "chain", "by points"]) if kind else ""
        if kind:
            origin, axes, number = rng.uniform(-2, -1, 3), frame(rng), 10
            x = inside(x, origin, axes, kind)
            corners = on_axes(origin, axes)
            if way == "chain":
                first, second = rng.uniform(1, 2, 3), frame(rng)
                head.append(self.system(4, "C", on_axes(first, second)))
                corners = inside(corners, first, second, "C")
            if way == "by points":
                head.append(self.card(f"CORD1{kind}", number, 9001, 9002, 9003))
                extra_points = [self.card("GRID", 9001 + k, "", *p) for k, p in enumerate(corners)]
            else:
                head.append(self.system(number, kind, corners, 4 if way == "chain" else 0))
        given = "" if way == "default" else number or ""
        if way == "default":
            head.append(self.card("GRDSET", "", number))
        order = rng.permutation(len(x))
        grids = [self.card("GRID", k + 1, given, *x[k]) for k in order] + extra_points
        name = "CTETRA" if self.kind[0] == "t" else "CHEXA"
        cells = [self.card(name, k + 1, 1, *(row + 1)) for k, row in enumerate(self.cells)]
        held = self.card("SPC1", 7, 123456, *(self.root + 1))
        files, bulk = {"deck.bdf": ""}, [*head, *grids, *cells, held, *extra]
        if rng.random() < 0.4:
            files["points.blk"] = "$ points\n" + "\n".join(grids) + "\n"
            ways = "INCLUDE 'points.blk'", 'include "points.blk"', "INCLUDE points.blk"
            bulk = [*head, rng.choice(ways), *cells, held, *extra]
        if rng.random() < 0.6:
            head = "SOL 103\nCEND\nSPC = 7\nTITLE = a bar, of steel\nBegin Bulk"
            bulk = [head, *bulk, "ENDDATA"]
        files["deck.bdf"] = "\n".join(bulk) + "\n"
        return files


class Keywords:
    """Abaqus and CalculiX."""

    digits = 10

    def __init__(self, rng, points, cells, root, kind):
        self.rng, self.points, self.cells, self.root, self.kind = rng, points, cells, root, kind
        self.change = rng.choice([str, str.lower, str.upper])

    def row(self, label, x):
        words = [f"{v:.10g}" if abs(v) > 1e-13 else "" for v in x]
        while words and not words[-1] and self.rng.random() < 0.7:
            words.pop()
        return ", ".join([str(label), *words])

    def write(self, extra):
        rng, x = self.rng, self.points
        head, tail, option = [], [], ""
        way = rng.choice(["", "system", "shift", "cylinder", "both"])
        if way == "shift":
            origin = rng.uniform(-1, 1, 3)
            x = x - origin
            head, tail = [f"*System\n{', '.join(f'{v:.10g}' for v in origin)}"], ["*System"]
        if way in ("system", "both"):
            origin, axes = rng.uniform(-1, 1, 3), frame(rng)
            x = inside(x, origin, axes, "R")
            a, b, c = origin, origin + 2 * axes[:, 0], origin + axes[:, 1] + 0.3 * axes[:, 0]
            rows = [", ".join(f"{v:.10g}" for v in row) for row in (np.r_[a, b], c)]
            head, tail = ["*SYSTEM\n" + "\n".join(rows)], ["*SYSTEM"]
        if way in ("cylinder", "both"):
            x, option = inside(x, np.zeros(3), np.eye(3), "C"), ", system=C"
        rows = [self.row(k + 1, x[k]) for k in rng.permutation(len(x))]
        files = {"deck.inp": ""}
        nodes = [f"*{self.change('Node')}{option}", *rows]
        if rng.random() < 0.3:
            files["points.txt"] = "** points\n" + "\n".join(rows) + "\n"
            source = rng.choice([", INPUT=points.txt", "\n*Include, input=points.txt"])
            nodes = [f"*NODE{option}{source}"]
        kind = {"hex8": "C3D8R", "tet4": "C3D4"}[self.kind]
        element = f"*Element, type={self.change(kind)}, elset={self.change('All')}"
        cells = [element, *self.rows_of_cells()]
        held = [f"*NSET, NSET={self.change('Root')}", *(f"{k + 1}," for k in self.root)]
        section = ["*SOLID SECTION, ELSET=aLL, MATERIAL=steel"]
        body = [*head, *nodes, *tail, *cells, *section]
        if rng.random() < 0.4:
            other = "*Part, name=Other\n*Node\n1, 5., 5., 5.\n*End Part"
            instance = "*Instance, name=Bar-1, part=BAR\n*End Instance"
            body = ["*Part, name=Bar", *body, "*Nset, nset=ROOT\n1,\n*End Part", other]
            body += ["*Assembly, name=A", instance, f"{held[0]}, instance=Bar-1", *held[1:]]
            body.append("*End Assembly")
        else:
            body += held
        files["deck.inp"] = "\n".join([*body, *extra]) + "\n"
        return files

    def rows_of_cells(self):
        """Each row written out, over two lines, or all made from the first where they can be."""
        rows = [[k + 1, *(row + 1)] for k, row in enumerate(self.cells)]
        made = self.generated(rows) if self.kind == "hex8" else None
        if made and self.rng.random() < 0.7:
            return [", ".join(map(str, rows[0])), "*ELGEN, ELSET=ALL", made]
        parts = [filter(None, (row[:5], row[5:])) for row in rows]
        return [",\n".join(", ".join(map(str, part)) for part in row) for row in parts]

    def generated(self, rows):
        """The row of ELGEN that gives these elements, of a grid of bricks."""
        steps = np.array([row[1] - rows[0][1] for row in rows])
        for nx, ny in product(range(1, 4), repeat=2):
            nz, rest = divmod(len(rows), nx * ny)
            dx, dy, dz = (steps[k] if k < len(rows) else 0 for k in (1, nx, nx * ny))
            dx, dy, dz = dx * (nx > 1), dy * (ny > 1), dz * (nz > 1)
            k, j, i = np.indices((nz, ny, nx)).reshape(3, -1)
            if not rest and np.array_equal(i * dx + j * dy + k * dz, steps):
                return f"1, {nx}, {dx or 1}, 1, {ny}, {dy}, {nx}, {nz}, {dz}, {nx * ny}"
        return None
