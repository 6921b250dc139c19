"""The page about files, from the tables that check them."""

from collections.abc import Iterator

from rom.config.component_keys import TABLE as COMPONENT
from rom.config.keys import Either, Key, Kind, Named, Table, Variants
from rom.config.laws import law_kind
from rom.config.mechanism_keys import mechanism_table
from rom.mbs.elements.formulas.codes import FUNCTIONS
from rom.units import UNITS, Dimension, dimension_name

PAGE_HEADER = """\
# Component and mechanism files

A component file says what a part is made of and how it is reduced; a mechanism file says how parts
are joined and moved. Both are [TOML](https://toml.io). `rom mesh`, `rom modes` and `rom reduce`
take the first, `rom simulate` the second, `rom report` and `rom view` both; options on the command
line go before the file. In Python they are `rom.read_component` and `rom.read_mechanism`.

A number with a unit stands in quotes, `"210 GPa"`; a plain number is in SI. A wrong dimension, an
unknown or missing key and a key given twice are told with file and line. Names of files are
relative to the folder of the file they stand in.
"""


def page(component: str, mechanism: str) -> str:
    """The page, in Markdown, with the texts of a component and a mechanism file as examples."""
    parts = [PAGE_HEADER, "## A component", f"```toml\n{component.strip()}\n```"]
    parts += list(_sections(COMPONENT))
    parts += ["## A mechanism", f"```toml\n{mechanism.strip()}\n```"]
    parts += list(_sections(mechanism_table()))
    parts += ["## Laws", LAWS_SECTION]
    parts += [f"**{name}.** {t.about}\n\n{keys(t)}" for name, t in tables(law_kind("1"))]
    parts += ["## Formulas", FORMULA_SECTION]
    parts += ["## Units", UNIT_SECTION, _units()]
    return "\n\n".join(parts) + "\n"


LAWS_SECTION = (
    "Functions of time, where a key says so: a plain value is constant, a table has a kind, which "
    "may be left out where there is an `expression` or a `function`. Values have the unit of what "
    "they prescribe: an angle or a displacement for drives, a torque or a force for motors, none "
    "for factors."
)
UNIT_SECTION = (
    "Products with a blank, powers with `^`, and each `/` belongs to the one unit behind it: "
    "`kg/m^3`, `N m/rad`, `m s^-2`."
)
FORMULA_SECTION = (
    "An `expression` has numbers, variables and constants of its place, `pi`, `+ - * / ^` (`**` is "
    "the same), parentheses, and the functions "
    + ", ".join(f"`{name}`" for name in FUNCTIONS)
    + ". All numbers in it are in SI, angles in radians. `log` is the natural logarithm; "
    "`step(t, start, end)` goes from 0 to 1 as 10 s^3 - 15 s^4 + 6 s^5 with s = (t - start) / "
    "(end - start). Formulas are read, never executed."
)


def tables(kind: Kind) -> Iterator[tuple[str, Table]]:
    """The tables a kind may be written as, with what tells them apart."""
    if isinstance(kind, Table):
        yield "", kind
    elif isinstance(kind, Named):
        yield from tables(kind.kind)
    elif isinstance(kind, Variants):
        yield from kind.tables.items()
    elif isinstance(kind, Either):
        yield from tables(kind.table)
    else:
        yield from getattr(kind, "parts", {}).items()


def _sections(table: Table) -> Iterator[str]:
    """Keys of a table, then the tables inside it."""
    yield keys(table)
    for key in table.keys:
        inner = list(tables(key.kind))
        if not inner:
            continue
        name = f"{key.name}.NAME" if isinstance(key.kind, Named) else key.name
        yield f"### [{name}]"
        if len(inner) > 1:
            yield key.about
        for word, one in inner:
            yield from _inside(word, one)


def _inside(word: str, table: Table) -> Iterator[str]:
    """A table below the first level, and what its keys may hold."""
    yield f"**{word}.** {table.about}" if word else table.about
    if table.keys:
        yield keys(table)
    for key in table.keys:
        inner = dict(tables(key.kind))
        for more, one in () if "run-up" in inner else inner.items():  # laws have their own section
            yield from _inside(f"{key.name}, {more}".strip(", "), one)


def keys(table: Table) -> str:
    """The keys of a table as a table in Markdown."""
    rows = ["| key | written as | default | meaning |", "|---|---|---|---|"]
    rows += [
        f"| `{k.name}` | {_cell(k.kind.summary)} | {_default(k)} | {_cell(k.about)} |"
        for k in table.keys
    ]
    return "\n".join(rows)


def _default(key: Key) -> str:
    """What stands in for a key, where one value does."""
    if key.default is ...:
        return "must be given"
    value = list(key.default) if isinstance(key.default, tuple) else key.default
    if value is None or isinstance(value, dict) or value == []:
        return ""
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    return "`" + str(value).replace("'", '"') + "`"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("[", "\\[").replace("]", "\\]")


def _units() -> str:
    found: dict[Dimension, list[str]] = {}
    for name, unit in UNITS.items():
        found.setdefault(unit.dimension, []).append(f"`{name}`")
    rows = [f"| {dimension_name(d)} | {', '.join(names)} |" for d, names in found.items()]
    return "\n".join(["| of | units |", "|---|---|", *rows])
