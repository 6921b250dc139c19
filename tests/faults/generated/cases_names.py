"""Names that people give never become paths, commands, tags or code."""

import ast
import csv

import rom
from generated.case import Case, Works, case, edit, require
from generated.stock import STEEL, body, model, origin, pendulum
from rom.errors import ConfigError, InterfaceError, ModelError, ParameterError
from rom.report.html import paragraph

HOSTILE = {
    "a path upwards": "../pwned",
    "an absolute path": "/nowhere/pwned",
    "a folder": "a/b",
    "a path of Windows": "a\\..\\b",
    "two points": "..",
    "nothing": "",
    "a blank": " ",
    "two lines": "a\nb",
    "a zero byte": "a\0b",
    "three hundred letters": "x" * 300,
    "an option": "-rf",
    "a command": "$(touch pwned)",
    "code": '"""; open("pwned", "w"); """',
    "code in quotes": "'); open('pwned', 'w'); ('",
    "a tag": "<script>alert(1)</script>",
    "a comma and a quote": 'a,"b',
    "no text": 7,
}
REFUSED = (ConfigError, ModelError, InterfaceError)
FORMATS = ("exudyn", "fmu", "vtu", "mbdyn", "abaqus", "sid")
MISSING = {  # command lines that lack several things, and all of them
    "modes": ("modes box.msh --nu 0.3", ("--E", "--rho")),
    "reduce": (f"reduce box.msh {STEEL}", ("-i", "-o")),
    "simulate": ("simulate good.npz", ("--hinge", "--t-end", "--dt", "-o")),
    "swing": ("swing box.msh", ("--hinge", "-o")),
    "export": ("export", ("file", "output")),
}


def simulated(name):
    """A body of this name moves, and its table is whole."""

    def act(folder):
        mech = rom.Mechanism()
        ball = mech.add_rigid(
            name, mass=1.0, inertia=(1e-3,) * 3, at=(0, 0, 0), markers={"a": (0, 0, 0)}
        )
        mech.spherical("ball", origin(mech), ball.marker("a"))
        table(rom.simulate(mech, t_end=0.02, dt=0.01), folder)

    return act


def marked(name):
    """A marker of this name, likewise."""

    def act(folder):
        markers = {"pin": (-0.2, 0, 0), name: (0.1, 0, 0)}
        table(rom.simulate(pendulum(markers=markers), t_end=0.02, dt=0.01), folder)

    return act


def joined(name):
    """A joint of this name, likewise."""

    def act(folder):
        mech = rom.Mechanism()
        ball = mech.add_rigid(
            "ball", mass=1.0, inertia=(1e-3,) * 3, at=(0, 0, 0), markers={"a": (0, 0, 0)}
        )
        mech.spherical(name, origin(mech), ball.marker("a"))
        table(rom.simulate(mech, t_end=0.02, dt=0.01), folder)

    return act


def table(solution, folder):
    """Every line of the table has as many cells as the first."""
    with rom.write_history(solution, folder / "a.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    require(len(rows) == 4, f"{len(rows)} lines")
    require(len({len(row) for row in rows}) == 1, "lines of different lengths")


def exported(name, to):
    """A body of this name in another format: no file elsewhere, no code but that of a plain name."""

    def act(folder):
        path = rom.export(body(name=name), folder / "out.x", to=to)
        if to == "exudyn":
            plain = rom.export(body(name="plain"), folder / "plain.x", to=to)
            same = [[type(n) for n in ast.walk(ast.parse(p.read_text()))] for p in (path, plain)]
            require(same[0] == same[1], "the name became code")

    return act


def reported(name):
    """A report shows the name, and does not run it."""

    def act(folder):
        rom.write_report({name: [paragraph(name)]}, folder / "a.html", name)
        require("<script>alert" not in (folder / "a.html").read_text(), "the name became a tag")

    return act


def saved(name):
    """A body of this name comes back."""

    def act(folder):
        found = rom.load(rom.save(body(name=name), folder / "a.npz"))
        require(found.name == name, found.name)

    return act


def shown(name):
    return repr(name) if not isinstance(name, str) else ("name", repr(name), name[:20] or "empty")


def each(what, act, names=tuple(HOSTILE)) -> list[Case]:
    return [case(f"{what}: {n}", act(HOSTILE[n]), (*REFUSED, Works), shown(HOSTILE[n]),
                 ) for n in names]  # fmt: skip


def two_wrong(**names):
    """Two interfaces that are not there."""
    return lambda folder: rom.reduce(
        model(), method=rom.Guyan(), interfaces=dict.fromkeys(("rot", "tipp"), "rbe2") | names
    )


CASES = [
    *each("a body", simulated),
    *each("a marker", marked),
    *each("a joint", joined),
    *each("a body file", saved),
    *(one for to in FORMATS for one in each(to, lambda n, to=to: exported(n, to),
      ("two lines", "code", "code in quotes", "a path upwards", "a zero byte"))),
    *each("a report", reported, ("a tag", "a path upwards", "two lines")),
    *(case(f"rom {verb} without several things", line, ConfigError, *words)
      for verb, (line, words) in MISSING.items()),
    case("two interfaces that are not there", two_wrong(), InterfaceError, "rot", "tipp"),
    case("two supports that are not there", lambda folder: rom.modes(model(), 3, fixed=("rot", "tipp")),
         InterfaceError, "rot", "tipp"),
    case("two sets that are not there", "reduce K.mtx --mass M.mtx --nodes deck.inp -i rot=rbe2 "
         "-i tipp=rbe2 -o a.npz", (ConfigError, InterfaceError, rom.errors.FileFormatError), "rot",
         "tipp"),
    case("two parameters that are not there", lambda folder: rom.load("family.npz").at(rhoo=1, E=2),
         ParameterError, "rhoo", "E"),
    case("two keys that are not there", "simulate pendulum.toml -o out", ConfigError, "masss", "atx",
         given=(edit("pendulum.toml", "mass =", "masss ="), edit("pendulum.toml", "at =", "atx ="))),
    case("two markers that are not there", "simulate pendulum.toml -o out", (ConfigError, ModelError),
         "'pm'", "'pn'", given=edit("pendulum.toml", '{ ground = [0, 0, 0] }, "bob.pin"', '"bob.pm", "bob.pn"')),
    case("a parent that is a file", "export good.npz good.npz/x.vtu", ConfigError, "good.npz"),
]  # fmt: skip
