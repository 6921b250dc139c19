"""JSON Schemas of what each verb prints with ``--json``; one more for errors.

They are the contract: a key may be added, none removed or given another meaning, within one major
version. Numbers that are not finite are null.
"""

from collections.abc import Callable, Sequence
from typing import Any

from rom.fields import find

Schema = dict[str, Any]
SCHEMA_DIALECT = "https://json-schema.org/draft/2020-12/schema"


def _plain(kind: object) -> Callable[[str], Schema]:
    return lambda about: {"type": kind, "description": about}


text, whole, flag = map(_plain, ("string", "integer", "boolean"))
number = _plain(["number", "null"])  # null when it is not finite


def each(item: Schema, about: str) -> Schema:
    """A list."""
    return {"type": "array", "items": item, "description": about}


def by_name(item: Schema, about: str) -> Schema:
    """An object with any names."""
    return {"type": "object", "additionalProperties": item, "description": about}


def record(about: str, optional: Sequence[str] = (), **keys: Schema) -> Schema:
    """An object with these keys and no other."""
    return {
        "type": "object",
        "description": about,
        "properties": keys,
        "required": [name for name in keys if name not in optional],
        "additionalProperties": False,
    }


def rows(about: str, **keys: Schema) -> Schema:
    """A list of objects with these keys."""
    return each(record(about, (), **keys), about)


def maybe(schema: Schema) -> Schema:
    """Or null."""
    return {"anyOf": [schema, {"type": "null"}], "description": schema["description"]}


def metres(about: str) -> Schema:
    """A place."""
    return each(number("[m]"), f"{about} [m]")


def direction(about: str) -> Schema:
    """A vector of length one."""
    return each(number("unit"), about)


FILE, OUTPUT = text("the file read"), text("the file written")
FREQUENCIES = each(number("[Hz]"), "natural frequencies [Hz], ascending")
FACES = rows(
    "all faces of a .step file, with --faces; null is what one has not",
    number=whole("by which it is picked"),
    kind=text("plane, cylinder, cone, sphere, torus or other"),
    area=number("[m^2]"),
    middle=metres("centroid"),
    radius=number("of a cylinder, a sphere or the tube of a torus [m]"),
    axis=maybe(direction("axis of a cylinder, a cone or a torus")),
    point=maybe(metres("on that axis; centre of a sphere")),
    normal=maybe(direction("outward normal of a plane")),
    name=text("interface it belongs to; may be empty"),
)
NEXT = each(text("command"), "what to type next")
FILES = each(text("file"), "files written")
REPORT = record(
    "outcome of checks",
    title=text("what was checked"),
    ok=flag("whether every row holds"),
    rows=rows(
        "the checks",
        quantity=text("what"),
        value=number("its value"),
        limit=text("its limit in words"),
        ok=flag("whether it holds"),
    ),
)
STIFFENED = {"geometric stiffness": each(text("load"), "unit loads it stiffens under")}
VERBS: dict[str, Schema] = {
    "doctor": record(
        "what is installed and works",
        rom=text("version of rom"),
        findings=rows(
            "everything looked at",
            topic=text("heading"),
            name=text("what"),
            value=text("version, place or number"),
            state={"enum": ["ok", "note", "missing", "broken"], "description": "verdict"},
            advice=text("what to type; empty if nothing"),
        ),
    ),
    "demo": record(
        "the demos; of one that was run, its numbers; of a copy, its files",
        optional=("demos", "results", "files"),
        demos=by_name(by_name(text("one of them"), "its title, needs and time"), "what there is"),
        results=by_name(by_name(number("one of them"), "value, expected, tolerance"), "numbers"),
        files=FILES,
    ),
    "mesh": record(
        "what a mesh holds",
        optional=("saved", "faces"),
        file=FILE,
        cell_type=text("tet4, tet10, hex8 or hex27"),
        cells=whole("number of cells"),
        nodes=whole("number of nodes"),
        box=each(each(number("[m]"), "lowest, highest [m]"), "extent along x, y, z"),
        volume=number("[m^3]"),
        regions=by_name(
            record("a region", cells=whole("number of cells"), volume=number("[m^3]")), "regions"
        ),
        interfaces=by_name(
            record(
                "an interface",
                optional=("axis", "point"),
                facets=whole("number of facets"),
                nodes=whole("number of nodes"),
                middle=metres("middle of its box"),
                axis=direction("axis of its cylinder faces"),
                point=metres("on that axis, where joints sit"),
            ),
            "interfaces",
        ),
        ties=by_name(whole("nodes of the deck"), "rigid and averaging elements of a deck"),
        masses=rows(
            "point masses of a deck", interface=text("what carries it"), mass=number("[kg]")
        ),
        springs=each(text("its name"), "springs of a deck"),
        faces=FACES,
        quality=by_name(number("figure"), "figures of quality"),
        parameters=by_name(number("as used"), "those of the geometry that are numbers, e.g. lc"),
        saved=text("the file written by --save"),
    ),
    "modes": record(
        "natural modes of the full model",
        file=FILE,
        n_dofs=whole("displacement dofs"),
        mass=number("[kg]"),
        fixed=each(text("interface"), "interfaces held"),
        frequencies=FREQUENCIES,
        residual=each(number("relative"), "relative residual of each mode"),
    ),
    "reduce": record(
        "the reduced body",
        (),
        output=OUTPUT,
        name=text("name of the body"),
        mass=number("[kg]"),
        n_modes=whole("elastic coordinates"),
        reference=text("how its frame follows"),
        interfaces=each(text("interface"), "names"),
        frequencies=FREQUENCIES,
        certificate=maybe(REPORT),
        provenance={"type": "object", "description": "how it was made"},
        **STIFFENED,
    ),
    "check": record(
        "checks of a body file; of another file, what it is",
        optional=("dialect", "name", "report", "kind", "next"),
        file=FILE,
        kind=text("what the file is, if no body"),
        next=NEXT,
        name=text("name of the body"),
        dialect=text("of a .SID_FEM"),
        report=REPORT,
    ),
    "export": record("a file of another program", file=FILE, output=OUTPUT, format=text("which")),
    "simulate": record(
        "a motion",
        output=text("the table of the motion"),
        also=each(text("file"), "other files written"),
        steps=whole("time steps kept"),
        status=text("how the run ended"),
        events=by_name(each(number("[s]"), "times [s]"), "when each event happened, by name"),
        audit=REPORT,
    ),
    "view": record(
        "a picture, or a window that was closed again",
        file=FILE,
        output=maybe(text("the picture; null for a window")),
    ),
    "report": record(
        "a report",
        file=FILE,
        output=OUTPUT,
        title=text("its heading"),
        sections=each(text("heading"), "its parts"),
    ),
    "open": record("what was made while a part was open", files=FILES),
    "swing": record(
        "a part on its hinge; without one, its faces",
        optional="mass gravity axis t_end magnify frequencies certificate faces next".split(),
        faces=FACES,
        next=NEXT,
        files=FILES,
        mass=number("[kg]"),
        gravity=each(number("[m/s^2]"), "gravity [m/s^2]"),
        axis=direction("about which it turns"),
        t_end=number("duration [s]"),
        magnify=number("deformations are drawn so much larger"),
        frequencies=FREQUENCIES,
        certificate=REPORT,
    ),
    "bench": record(
        "figures of speed and memory; with --list the benchmarks",
        optional=("figures", "benchmarks"),
        benchmarks=by_name(text("what it measures"), "the benchmarks there are"),
        figures=rows(
            "what was measured",
            benchmark=text("its name"),
            case=text("what was run"),
            quantity=text("what was measured"),
            value=number("the number"),
            unit=text("its unit; empty for a ratio"),
            aim=text("what it should be; empty if for information"),
        ),
    ),
    "completion": record("completion", shell=text("bash or zsh"), text=text("the script")),
}
ERROR = record(
    "an error",
    ok={"const": False, "description": "nothing was done"},
    error=text("its class"),
    message=text("what happened"),
    hint=text("what to do; may be empty"),
    exit_code=whole("1 to 7"),
)


def answer_of(verb: str) -> Schema:
    """The schema of the answer of a verb, which may be that of a field."""
    own: Schema = VERBS.get(verb) or find("verbs", verb).SCHEMA
    return own


def schema(verb: str) -> Schema:
    """The schema of everything a verb can print with ``--json``: its answer, or an error."""
    own = answer_of(verb)
    answer = own | {
        "properties": {"ok": flag("whether everything holds")}
        | own["properties"]
        | {
            "warnings": each(text("warning"), "what a careful user wants to know"),
            "failed": each(text("failure"), "what did not hold, if anything"),
        },
        "required": ["ok", *own["required"], "warnings"],
    }
    return {"$schema": SCHEMA_DIALECT, "title": f"rom {verb} --json", "anyOf": [answer, ERROR]}
