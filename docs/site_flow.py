"""The flow from a geometry to results as one picture, drawn from the imports in the source.

Nothing is imported of what is drawn: files are read as text. A folder without a stage is an error,
so that the picture shows all there is.
"""

import ast
import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

import rom
from rom.view.canvas import page

SOURCE = Path(rom.__file__).parent
STAGES = {  # what lies on the way, and the folders and files in which it lies
    "geometry": ("decks", "fe.mesh"),
    "matrices": ("fe.forms", "fe.operators", "fe"),
    "modes": ("eigen", "reduction.interfaces", "reduction.bases", "reduction.full_model"),
    "body": ("body", "checks", "stages", "workflow", "io", "assembly"),
    "mechanism": ("mbs.kernels", "mbs.parts", "mbs.elements", "mbs"),
    "motion": ("mbs.equations", "mbs.integrate", "mbs.results"),
    "results": ("mbs.analysis", "view", "fmu"),
}
COMPONENTS, FRONT, GROUND = "components", "front", "ground"
COMPONENT_FRONTS = ("parametric", "updating", "cyclic", "prestress")
GROUND_FOLDERS = ("arguments", "paths", "process")  # beside the single files at the top
FRONTS = ("cli", "config", "report", "doctor", "__main__")
HANDED_ON = ("SolidMesh", "FEModel", "Basis", "FlexibleBody", "Mechanism", "Solution")
WIDTH, MARGIN, BOX = 1500, 30, 158  # of the sheet, around it, of a stage [pixel]
STEP = (WIDTH - 2 * MARGIN - BOX) / (len(STAGES) - 1)  # from stage to stage [pixel]
LINE = 27  # from line to line in a list [pixel]
TOPS = {"front": 85, "components": 150, "stages": 345, "lists": 450, "arcs": 720, "ground": 940}
FLOW, BACK, PALE, INK, GREY = "#2f7f9f", "#d1495b", "#e9f1f5", "#1d2733", "#5c636e"
CAPTION = (
    "Each column is a stage: its folders below rom/ and how many files they hold. Thick arrows "
    "hand on the record whose name stands below them. Thin ones count imports: {forward} of an "
    "earlier stage by a later one (blue), {back} of a later stage by an earlier one (red, dashed), "
    "and upwards those of the stages by components. Mechanism and motion import next to nothing "
    "from the left: what moves is computed without finite elements, from the arrays of a body. "
    "Drawn from the source whenever these pages are made."
)


def modules(source: Path = SOURCE) -> dict[str, Path]:
    """{dotted name below rom: file} of all modules; fronts of packages have the package's name."""
    found = {}
    for path in sorted(source.rglob("*.py")):
        parts = path.relative_to(source).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def stage_of(module: str) -> str:
    """The stage, or strip of the picture, in which a module lies.

    Raises:
        KeyError: naming a folder that has none.
    """
    places = {part: stage for stage, parts in STAGES.items() for part in parts}
    places = {part.partition(".")[0]: stage for part, stage in places.items()} | places
    places |= dict.fromkeys((COMPONENTS, *COMPONENT_FRONTS), COMPONENTS)
    places |= dict.fromkeys(FRONTS, FRONT)
    parts = module.split(".")
    for n in (2, 1):
        if ".".join(parts[:n]) in places:
            return places[".".join(parts[:n])]
    if (SOURCE / parts[0]).is_dir() and parts[0] not in GROUND_FOLDERS:
        raise KeyError(f"rom.{module} has no stage in docs/site_flow.py")
    return GROUND


def imports(path: Path) -> Iterator[str]:
    """Dotted names below rom of what a file imports, functions included."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] == "rom":
            inside = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from {name.removeprefix("rom.") for name in inside}
        elif isinstance(node, ast.Import):
            names = (alias.name for alias in node.names)
            yield from (name.removeprefix("rom.") for name in names if name.startswith("rom."))


def counted(source: Path = SOURCE) -> Counter[tuple[str, str]]:
    """{(stage imported, stage that imports it): number of names}, of different stages."""
    found: Counter[tuple[str, str]] = Counter()
    for module, path in modules(source).items():
        for name in imports(path) if module else ():
            pair = stage_of(name), stage_of(module)
            found[pair] += pair[0] != pair[1]
    return +found


def files_in(part: str, source: Path = SOURCE) -> int:
    """How many files a folder holds that belong to it and to no other folder of the picture."""
    others = {p for parts in STAGES.values() for p in parts if p.startswith(f"{part}.")}
    return sum(
        (name == part or name.startswith(f"{part}.")) and not name.startswith(tuple(others))
        for name in modules(source)
    )


def defined(record: str, source: Path = SOURCE) -> str:
    """The module that defines a class.

    Raises:
        KeyError: if none does.
    """
    for module, path in modules(source).items():
        if re.search(rf"^class {record}\b", path.read_text(), re.M):
            return module
    raise KeyError(f"rom has no class {record}")


def draw(path: Path) -> Path:
    """Draw the picture.

    Args:
        path: file to write, .png.
    """
    links = counted()
    with page.styled():
        forward = {pair: n for pair, n in _between_stages(links) if _rank(pair[0]) < _rank(pair[1])}
        back = {pair: n for pair, n in _between_stages(links) if pair not in forward}
        said = CAPTION.format(forward=sum(forward.values()), back=sum(back.values()))
        text, below = page.caption(said, WIDTH - 2 * MARGIN)
        height = TOPS["ground"] + 95 + below + 15
        figure = page.sheet(WIDTH, height)
        axes = page.area(figure, 0, 0, WIDTH, height)
        axes.set_xlim(0, WIDTH)
        axes.set_ylim(height, 0)
        axes.set_axis_off()
        _write(
            axes,
            MARGIN,
            38,
            "From a geometry to results: the stages of rom, and what they take from each other",
            "title",
        )
        _strips(axes)
        _stages(axes)
        _to_components(axes, links)
        _arcs(axes, forward, FLOW, "-")
        _arcs(axes, back, BACK, "--")
        page.words(figure, text, MARGIN, TOPS["ground"] + 90, size=page.SMALL_SIZE)
        page.save(figure, path)
    return path


def _rank(stage: str) -> int:
    return [*STAGES].index(stage)


def _between_stages(links: Counter[tuple[str, str]]) -> list[tuple[tuple[str, str], int]]:
    return [(pair, n) for pair, n in sorted(links.items()) if {*pair} <= {*STAGES}]


def _left(stage: str) -> float:
    return MARGIN + STEP * _rank(stage)


def _write(axes: Any, x: float, y: float, text: str, look: str = "", **options: Any) -> None:
    sizes = {"title": page.TITLE_SIZE, "small": page.SMALL_SIZE}
    weight = "bold" if look == "title" else "normal"
    options = {"color": INK, "va": "center", "weight": weight} | options
    axes.text(x, y, text, size=sizes.get(look, page.BODY_SIZE), **options)


def _box(axes: Any, corner: tuple[float, float], size: tuple[float, float], **look: Any) -> None:
    from matplotlib.patches import FancyBboxPatch

    style: dict[str, Any] = {"boxstyle": "round,pad=0,rounding_size=8", "lw": 1.0, "ec": GREY}
    axes.add_patch(FancyBboxPatch(corner, *size, **style | look))


def _strip(axes: Any, top: float, height: float, name: str, lines: list[str]) -> None:
    _box(axes, (MARGIN, top), (WIDTH - 2 * MARGIN, height), fc="#f4f5f7")
    _write(axes, MARGIN + 15, top + height / 2, name, weight="bold")
    for k, line in enumerate(lines):
        _write(axes, MARGIN + 190, top + height * (k + 1) / (len(lines) + 1), line, "small")


def _strips(axes: Any) -> None:
    fields = [m.partition(".")[2] for m in modules() if m.startswith("components.")]
    names = sorted({name.partition(".")[0] for name in fields} - {"compiled"})
    half = (len(names) + 1) // 2
    lines = [", ".join(part).replace("_", " ") for part in (names[:half], names[half:])]
    fronts = (f"{name} ({files_in(name)})" for name in FRONTS if name != "__main__")
    _strip(axes, TOPS["front"], 50, "in front", [", ".join(fronts)])
    _strip(axes, TOPS["components"], 90, "components", [lines[0] + ",", lines[1]])
    ground = sorted(m for m in modules() if "." not in m and m and stage_of(m) == GROUND)
    half = (len(ground) + 1) // 2
    lines = [", ".join(ground[:half]) + ",", ", ".join(ground[half:])]
    _strip(axes, TOPS["ground"], 75, "for all stages", lines)


def _stages(axes: Any) -> None:
    for stage, parts in STAGES.items():
        left, top = _left(stage), TOPS["stages"]
        _box(axes, (left, top), (BOX, 48), fc=FLOW, ec=FLOW)
        _write(axes, left + BOX / 2, top + 24, stage, ha="center", color="white", weight="bold")
        _box(axes, (left, TOPS["lists"]), (BOX, 8 * LINE + 20), fc=PALE, ec="none")
        for k, (name, count) in enumerate(_listed(parts)):
            y = TOPS["lists"] + 10 + (k + 0.5) * LINE
            _write(axes, left + (24 if name.startswith(".") else 10), y, name.strip("."), "small")
            _write(axes, left + BOX - 10, y, count, "small", ha="right", color=GREY)
    for record, stage in zip(HANDED_ON, STAGES, strict=False):
        defined(record)
        start, end, y = _left(stage) + BOX + 6, _left(stage) + STEP - 6, TOPS["stages"] + 24
        arrow = {"arrowstyle": "-|>,head_width=0.5,head_length=0.7", "lw": 5, "color": FLOW}
        axes.annotate("", (end, y), (start, y), arrowprops=arrow | {"shrinkA": 0, "shrinkB": 0})
        _write(axes, (start + end) / 2, y + 50, record, "small", ha="center", style="italic")


def _listed(parts: tuple[str, ...]) -> list[tuple[str, str]]:
    """Lines (name, number of files) of a stage; folders in a folder stand indented below it."""
    around = {part.partition(".")[0] for part in parts if "." in part}
    lines: dict[str, str] = {}
    for part in parts:
        folder, _, inside = part.partition(".")
        if folder in around:
            lines.setdefault(f"{folder}/", "")
        lines[f".{inside}" if inside else f"{folder}/" * (folder in around) or folder] = str(
            files_in(part)
        )
    return [*lines.items()]


def _to_components(axes: Any, links: Counter[tuple[str, str]]) -> None:
    bottom = TOPS["components"] + 90
    for stage in STAGES:
        if n := links[stage, COMPONENTS]:
            x = _left(stage) + BOX / 2
            arrow = {"arrowstyle": "-|>", "lw": _thickness(n), "color": FLOW, "shrinkA": 0}
            axes.annotate("", (x, bottom + 4), (x, TOPS["stages"]), arrowprops=arrow)
            _write(axes, x + 12, (bottom + TOPS["stages"]) / 2, str(n), "small", color=FLOW)


def _thickness(n: int) -> float:
    return 0.8 + 0.3 * float(n) ** 0.5


def _arcs(axes: Any, pairs: dict[tuple[str, str], int], colour: str, style: str) -> None:
    """Curves below the columns, from the stage that is imported to the one that imports."""
    from matplotlib.patches import FancyArrowPatch
    from matplotlib.path import Path as Curve

    for (used, user), n in pairs.items():
        ahead = 1 if _rank(user) > _rank(used) else -1
        span = abs(_rank(user) - _rank(used))
        side = 66 - 20 * span if ahead > 0 else -16
        ends = [_left(used) + BOX / 2 + side, _left(user) + BOX / 2 - side]
        low = TOPS["arcs"] + (70 if ahead < 0 else 25) + 62 * span
        points = [(ends[0], TOPS["arcs"] - 28), (ends[0], low), (ends[1], low)]
        curve = Curve([*points, (ends[1], TOPS["arcs"] - 28)], [1, 4, 4, 4])
        look: dict[str, Any] = {"lw": _thickness(n), "color": colour, "ls": style}
        axes.add_patch(FancyArrowPatch(path=curve, arrowstyle="-|>", mutation_scale=14, **look))
        middle = TOPS["arcs"] - 28 + 0.75 * (low - TOPS["arcs"] + 28)
        _write(axes, sum(ends) / 2, middle, str(n), "small", ha="center", color=colour,
               bbox={"fc": "white", "ec": "none", "pad": 1.5})  # fmt: skip


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx, after the pages among which the picture is put."""
    app.connect(
        "builder-inited",
        lambda app: draw(Path(app.srcdir) / "generated" / "flow.png"),
        priority=600,
    )
    return {"parallel_read_safe": True, "parallel_write_safe": True}
