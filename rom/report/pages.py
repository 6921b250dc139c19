"""Reports in one HTML file: of a body, of a component or mechanism file, of a finished run."""

import csv
import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import rom.body
from rom.checks.gates import check
from rom.config.component import read_component
from rom.config.document import read_document
from rom.config.mechanism import MechanismFile, read_mechanism
from rom.config.mechanism_keys import sections as sections_of_files
from rom.errors import ConfigError, FileFormatError, RomError
from rom.io.files import WRONG_JSON, damaged, need
from rom.io.native import load
from rom.model import Report, Row
from rom.process import stopwatch as watch
from rom.process.child import scratch
from rom.report import html
from rom.report.run import RECORD_FILE, SCENE_FILE, Run, look_of, run, versions
from rom.report.scene import SHAPE_BYTES, Scene, modes_scene, motion_scene, read_scene, start_scene
from rom.report.viewer import MOTION_WORDS, START_WORDS, figure, modes_words
from rom.view.figures.curves import frequencies, history
from rom.view.scenes.film import instants, start
from rom.view.scenes.mode_shapes import mode_shapes

Sections = dict[str, Sequence[str]]
Told = dict[str, Any]  # of JSON, or of the provenance of a body
N_FREQUENCIES = 6
SHOWN_KEYS = "path sha256 parameters faces scale material degree solver K M units".split()
BODY_COLUMNS = ("body", "mass [kg]", "elastic coordinates", "markers")
NO_STILL = "The run made no picture: picture = true of its [output] asks for one."
ENERGIES = ("kinetic", "strain", "potential", "total")


def describe(
    source: Path,
    *,
    command: str = "",
    version: str = "",
    move: bool = False,
    progress: bool = False,
    **meshing: Any,
) -> tuple[str, Sections]:
    """Title and sections of a report, for `rom.report.html.write_report`.

    The source is a body file, a component or mechanism file, or the folder of a run. Command and
    version are for the record; ``move`` moves the mechanism of a file, with progress on stderr;
    ``meshing`` holds ``trust``, ``time_limit`` and ``memory_limit`` of `rom.read_component`.
    """
    made = {"rom": version} | versions()
    described = source.suffix.lower() == ".toml" and not source.is_dir()
    if described and "bodies" in read_document(source).data:
        file = read_mechanism(source, **meshing)
        moved = run(file, progress=progress) if move else None
        return of_mechanism(file, how(command, made), moved)
    if move:
        raise ConfigError(f"{source} must be a mechanism file to be moved; leave move out.")
    if source.is_dir():
        return of_run(source)
    if described:
        component = read_component(source, **meshing)
        written = html.source(source.read_text(encoding="utf-8"))
        title, sections = of_body(component.body(), how(command, made))
        return title, sections | {"The file": [written]}
    return of_body(load(source), how(command, made))


def how(command: str, made: dict[str, str]) -> list[str]:
    """Command and versions."""
    versions = html.table(("", "version"), list(made.items()), "What the numbers were made with.")
    return [html.source(command), versions]


def of_body(body: "rom.body.FlexibleBody", made: list[str]) -> tuple[str, Sections]:
    """A flexible body: what it is, mass, frequencies, interfaces, checks, pictures."""
    sections: Sections = {
        "What it is": [html.paragraph(_sentence(body)), *_mode_figure(body)],
        "Mass properties": [_mass_table(body)],
        "Frequencies": _frequency_blocks(body),
        "Interfaces": [_interface_table(body)],
        "Checks": [html.checks(check(body), "What rom check says.")],
        "How it was made": [*made, *_provenance(body)],
    }
    return f"Flexible body {body.name}", sections


def _sentence(body: "rom.body.FlexibleBody") -> str:
    reduction = body.provenance.get("reduction", {})
    full = f" from {reduction['full dofs']} dofs" if "full dofs" in reduction else ""
    method = f" by {_method_words(reduction)}" if "method" in reduction else ""
    evidence = "carries no certificate"
    if body.certificate is not None:
        evidence = "has a certificate that " + ("holds" if body.certificate.ok else "FAILS")
    return _failing({f"the certificate of {body.name}": body.certificate}) + (
        f"{body.name} is a flexible body of {body.mass:.5g} kg and {1e3 * body.size:.4g} mm, "
        f"reduced{full} to {body.n_modes} elastic coordinates{method}; its frame follows "
        f"{body.reference}. It {evidence}."
    )


def _failing(reports: dict[str, Report | None]) -> str:
    """What comes before all else where a report does not hold, and where most."""
    bad = {name: x.worst.quantity for name, x in reports.items() if x is not None and not x.ok}
    words = "Do not rely on this yet: {} FAILS, most in {}. "
    return "".join(words.format(*x) for x in bad.items())


def _method_words(reduction: Told) -> str:
    """The method as it was called, without what was not given, and how many modes that came to."""
    label = re.sub(r"\b\w+=None(, )?", "", reduction["method"]).replace(", )", ")")
    modes = len(reduction.get("frequencies of the modes kept [Hz]", ()))
    if label.endswith("()"):
        label = f"{label[:-2]}, asked for as many modes as the certificate needs"
    return f"{label}: {modes} modes" if modes else label


def _mass_table(body: "rom.body.FlexibleBody") -> str:
    c = body.first_moment / body.mass
    central = body.inertia - body.mass * (c @ c * np.eye(3) - np.outer(c, c))
    rows: list[tuple[object, ...]] = [("mass [kg]", body.mass, "", "")]
    rows += [("mass centre [m]", *map(float, c))]
    rows += [(f"inertia, {axis} [kg m^2]", *map(float, central[k])) for k, axis in enumerate("xyz")]
    return html.table(("", "x", "y", "z"), rows, "Inertia about the mass centre, body axes.")


def _frequency_blocks(body: "rom.body.FlexibleBody") -> list[str]:
    every = body.provenance.get("comparison", {})
    comparison = {support: found for support, found in every.items() if found.get("full")}
    if not comparison:
        free = body.frequencies(N_FREQUENCIES + 6)[6:]
        rows = [(k + 1, float(f)) for k, f in enumerate(free)]
        caption = "Elastic frequencies of the reduced body, free. The file compares with no mesh."
        return [html.table(("mode", "reduced [Hz]"), rows, caption)]
    header = ("support", "mode", "full [Hz]", "reduced [Hz]", "error", "MAC")
    table: list[Sequence[object]] = []
    for support, found in comparison.items():
        pairs, mac = zip(found["full"], found["reduced"], strict=True), found.get("mac", ())
        for k, (f, g) in enumerate(pairs):
            likeness = float(mac[k]) if k < len(mac) else ""
            table.append((support, k + 1, float(f), float(g), f"{g / f - 1:.1e}", likeness))
    caption = "Natural frequencies of the full model and of the body, rigid motions left out."

    still = drawn(
        lambda path: frequencies(comparison, path, title=f"Reduced against full {body.name}"),
        "Errors of the frequencies.",
    )
    return [html.table(header, table, caption), *still]


def _interface_table(body: "rom.body.FlexibleBody") -> str:
    rows = [(m.name, m.kind, *map(float, m.point)) for m in body.markers.values()]
    header = ("interface", "kind", "x [m]", "y [m]", "z [m]")
    return html.table(header, rows, "Where joints and forces act, in the axes of the geometry.")


def _mode_figure(body: "rom.body.FlexibleBody", size: int = SHAPE_BYTES) -> list[str]:
    still = drawn(lambda path: mode_shapes(body, path), "Its lowest elastic modes.")
    return turning(lambda: modes_scene(body, size=size), still, modes_words(body.name))


def turning(make: Callable[[], Scene], still: list[str], caption: str) -> list[str]:
    """A figure that turns; or the still picture alone, where there is no scene."""
    try:
        return [figure(make(), still, caption)]
    except RomError as error:
        return [*still, html.paragraph(f"Nothing to turn around here: {error.message}")]


def _provenance(body: "rom.body.FlexibleBody") -> list[str]:
    said = body.provenance
    known = {key: said[key] for key in SHOWN_KEYS if key in said}
    versions = dict(said.get("versions", {})).items()
    known |= {f"{name}, when the body was made": version for name, version in versions}
    known |= {key: said[key] for key in ("seconds to reduce",) if key in said}
    if not known:
        return [html.paragraph("The body file does not say what it was made from.")]
    rows = [(key, _plain(value)) for key, value in known.items()]
    origin = html.table(("", "made from"), rows, "What the body file says of its origin.")
    return [origin, *_stages(said.get("stages", {}))]


def _stages(stages: dict[str, dict[str, float]]) -> list[str]:
    pieces = [watch.FACTORISATION_PIECE, watch.SOLUTION_PIECE, watch.SEARCH_PIECE, watch.REST_PIECE]
    notes = (watch.FLOPS_NOTE, watch.MISS_NOTE, watch.RESIDUAL_NOTE)
    rows = []
    for stage, found in stages.items():
        spent = f"{found['seconds']:.2f}", *(_piece(found, name) for name in pieces)
        noted = (f"{found[name]:.1e}" if name in found else "" for name in notes)
        rows.append((stage, *spent, f"{found['MB']:.0f}", *noted))
    header = ("stage", "seconds", *pieces, "memory [MB]", *notes)
    ranks = max((found.get("ranks", 1) for found in stages.values()), default=1)
    caption = (
        f"Where the time of the reduction went, in seconds of one process of {ranks}, and in "
        "brackets how often; the memory is the largest of that process so far."
    )
    return [html.table(header, rows, caption)] if rows else []


def _piece(stage: dict[str, float], name: str) -> str:
    if name not in stage:
        return ""
    number = stage.get(f"number of {name}")
    return f"{stage[name]:.2f}" + (f" ({number:g})" if number else "")


def _plain(value: object) -> str:
    """A value for a reader: 1,2 for lists, a: 1, b: 2 for tables."""
    if isinstance(value, dict):
        words = {True: "{} ({})", False: "{}: {}"}
        return ", ".join(words[isinstance(x, dict)].format(k, _plain(x)) for k, x in value.items())
    if isinstance(value, list | tuple):
        return "+".join(map(_plain, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def of_mechanism(
    file: MechanismFile, made: list[str], moved: Run | None = None
) -> tuple[str, Sections]:
    """A mechanism as it starts, and how it moves if it has been moved."""
    mechanism = file.mechanism() if moved is None else moved.solution.mechanism
    bodies = [
        (name, "flexible" if part.r else "rigid", float(part.mass), part.r, ", ".join(part.names))
        for name, part in mechanism.parts.items()
    ]
    header = (BODY_COLUMNS[0], "kind", *BODY_COLUMNS[1:])
    total = sum(part.mass for part in mechanism.parts.values())
    flexible = {n: p.flexible for n, p in mechanism.parts.items() if p.flexible is not None}
    judged = {f"the certificate of {name}": body.certificate for name, body in flexible.items()}
    words = _failing(judged if moved is None else judged | {"the audit": moved.audit}) + (
        f"{file.name} has {len(bodies)} bodies of together {total:.5g} kg and "
        f"{len(mechanism.joints)} joints; gravity is {file.values['gravity']} m/s^2."
    )
    look, title = look_of(file), f"Mechanism {file.name}"
    placed = "As its bodies are placed."
    still = drawn(lambda path: start(mechanism, path, title=title, **look), placed)
    turns = turning(lambda: start_scene(mechanism, title=title, **look), still, START_WORDS)
    sections: Sections = {
        "What it is": [html.paragraph(words), *turns],
        "Bodies": [html.table(header, bodies, "Bodies, and the names joints may use.")],
        "Joints and forces": [_connection_table(file)],
    }
    if moved is not None:
        sections["Motion"] = _motion(moved, look)
    for name, body in flexible.items():
        shown = [html.paragraph(_sentence(body)), *_mode_figure(body, SHAPE_BYTES // len(flexible))]
        sections[f"Body {name}"] = [*shown, *_frequency_blocks(body), _interface_table(body)]
    written = file.document.path.read_text(encoding="utf-8")
    return title, sections | {"How it was made": [*made, html.source(written)]}


def _motion(moved: Run, look: Told) -> list[str]:
    solution, how = moved.solution, look | {"magnify": moved.file.values["output"]["magnify"]}
    title = f"Motion of {moved.file.name}"
    words = "Instants at which the bodies are farthest from each other."
    still = drawn(lambda path: instants(solution.mechanism, solution, path, **how), words)
    turns = turning(lambda: motion_scene(solution, title=title, **how), still, MOTION_WORDS)
    checks = html.checks(moved.audit, "Is the computed motion believable?")
    return [html.paragraph(solution.status), *turns, checks]


def _connection_table(file: MechanismFile) -> str:
    rows = []
    some = (name for name, one in sections_of_files().items() if not one.single)
    for section in some:
        for name, values in file.values[section].items():
            ends = list(values.get("between") or values.get("markers") or [])
            ends += [values["marker"]] if "marker" in values else []
            where = [f"{body}.{m}" if isinstance(m, str) else f"{body} {m}" for body, m in ends]
            named = ("joint", "joint1", "joint2", "body")
            where += [values[key] for key in named if key in values]
            rows.append((name, values.get("kind", section.rstrip("s")), " and ".join(where)))
    return html.table(("name", "kind", "at"), rows, "Joints, drives and forces.")


def of_run(folder: Path) -> tuple[str, Sections]:
    """The folder that `rom simulate` leaves."""
    record = _record(folder)
    bodies = [
        (name, b["mass"], b["elastic coordinates"], ", ".join(b["markers"]))
        for name, b in record["bodies"].items()
    ]
    events = [
        (name, ", ".join(f"{t:.6g}" for t in times) or "never")
        for name, times in record.get("events", {}).items()
    ]
    audit = Report(record["audit"]["title"], tuple(Row(*row) for row in record["audit"]["rows"]))
    words = f"{record['name']} was moved for {record['t_end']:g} s in {record['steps']} steps. "
    pictures = {
        name: html.picture(folder / name, caption)
        for name, caption in (
            ("motion.gif", "The motion."),
            ("instants.png", "Four instants."),
            ("curves.png", "Histories, as asked for."),
        )
        if name in record["files"] and (folder / name).is_file()
    }
    if SCENE_FILE in record["files"] and (folder / SCENE_FILE).is_file():
        name = next((name for name in ("motion.gif", "instants.png") if name in pictures), "")
        still = [pictures.pop(name)] if name else [html.paragraph(NO_STILL)]
        moving = figure(read_scene(folder / SCENE_FILE), still, MOTION_WORDS)
        pictures = {SCENE_FILE: moving} | pictures
    joints = html.table(("joint", "kind"), list(record["joints"].items()), "Joints.")
    sections: Sections = {
        "What it is": [
            html.paragraph(_failing({"the audit": audit}) + words + record["status"]),
            *pictures.values(),
        ],
        "Bodies and joints": [html.table(BODY_COLUMNS, bodies, "Bodies."), joints],
    }
    if events:
        times = html.table(("event", "times [s]"), events, "When events happened.")
        sections["Events"] = [times]
    source = [html.source(record["source"])] if record["source"] else []
    return f"Motion of {record['name']}", sections | {
        "Checks": [html.checks(audit, "Is the computed motion believable?")],
        "Energy": _energy(folder, record),
        "How it was made": [*how(record["command"], record["versions"]), *source],
    }


def _record(folder: Path) -> Told:
    path = folder / RECORD_FILE
    if not path.is_file():
        why = f"there is no {RECORD_FILE}: this is not the folder of a run."
        hint = "rom simulate FILE.toml -o FOLDER makes one."
        raise FileFormatError(why, where=str(folder), hint=hint)
    with damaged("this is no record of a run", path, causes=WRONG_JSON):
        record: Told = json.loads(path.read_text(encoding="utf-8"))
        known = record["schema"] == "rom-run" and record["version"][0] == 1
        need(known, f"version {record['version']} is not known")
        wanted = ("name", "files", "bodies", "joints", "audit", "status", "steps", "t_end")
        missing = [k for k in (*wanted, "command", "versions", "source") if k not in record]
        need(not missing, f"it says nothing of {', '.join(missing)}")
        return record


def _energy(folder: Path, record: Told) -> list[str]:
    path = folder / "motion.csv"
    if not path.is_file():
        kept = record["files"][0] if record["files"] else "no file"
        return [html.paragraph(f"The motion is kept in {kept}, without energies over time.")]
    with path.open(newline="", encoding="utf-8") as file:
        head = next(csv.reader(file))
        numbers = np.loadtxt(file, delimiter=",", ndmin=2)
    curves = {name: numbers[:, head.index(f"{name} [J]")] for name in ENERGIES}
    kinds = {f"{name} [J]": (y[0], y.min(), y.max(), y[-1]) for name, y in curves.items()}
    rows = [(name, *map(float, found)) for name, found in kinds.items()]
    words = f"Energies of {record['name']}: motion, deformation, height, and their sum."
    header = ("energy", "start", "lowest", "highest", "end")
    t, panels = numbers[:, 0], [("energy [J]", curves)]
    still = drawn(
        lambda path: history(t, panels, path, title="Energy", caption=words), "Energies over time."
    )
    return [*still, html.table(header, rows, "Energies.")]


def drawn(draw: Callable[[Path], object], caption: str) -> list[str]:
    """A picture; or, where none can be made, a sentence that says why."""
    with scratch("report") as folder:
        path = folder / "picture.png"
        try:
            draw(path)
            return [html.picture(path, caption)]
        except RomError as error:
            return [html.paragraph(f"No picture here: {error.message}")]
