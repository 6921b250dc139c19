"""Pages made from the project itself: demos, pictures, errors, commands, the public interface.

They are written below ``generated/`` beside this file whenever the site is built, so that none of
them can be out of date.
"""

import ast
import importlib
import inspect
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from site_tasks import TASKS
from site_text import plain
from sphinx.application import Sphinx

import rom
from rom import errors
from rom.cli.parser import EXIT_CODES, build_parser, verb_modules
from rom.cli.schemas import ERROR, answer_of
from rom.config.page import page

ROOT = Path(rom.__file__).parents[1]
DEMOS = ROOT / "demos"
PICTURES = (ROOT / "out", DEMOS)  # what `make pictures` leaves, then those of the README
THUMBNAILS = Path(__file__).with_name("thumbnails")  # of the demos, by the name of the script
PICTURE = re.compile(r"\b(\w+\.(?:png|gif))\b")
ALSO = {  # what public functions give back or raise
    "errors": ("errors",),
    "mbs": (
        "mbs.results.solution",
        "mbs.analysis.linearize",
        "mbs.analysis.response",
        "mbs.analysis.campbell",
        "mbs.results.state",
        "mbs.parts.signals",
    ),
}
# packages without a name that `rom` has itself, or whose names stand in components
FURTHER_PARTS = ("eigen", "cyclic", "prestress", "parametric", "updating")
WHOLE_MODULES = ("rom.rotation", "rom.units")
CURES = {  # what to do about it, where no single message can tell
    "ConfigError": "Compare with `rom VERB --help` or the arguments of the function.",
    "UnknownNameError": "Take one of the names that the message lists.",
    "ParameterError": "Keep to the range the family was reduced for, or reduce it for a wider one.",
    "FileFormatError": "Write the file again; bodies are checked whole by `rom check`.",
    "UnsafeFileError": "Do not open it: a body file holds plain arrays only.",
    "MeshError": "Look at it with `rom mesh FILE --save mesh.vtu`, repair it where it is named.",
    "TagError": "Name each interface once, by a physical surface, a node set or `--face`.",
    "MaterialError": "Give E and rho above zero and nu between -1 and 0.5, in units of the mesh.",
    "InterfaceError": "Check the name with `rom mesh FILE`; take another kind or more nodes.",
    "ModelError": "Draw the mechanism as it starts; release the joint that is named.",
    "SolverError": "Take shorter steps or looser tolerances; see whether the model is held.",
    "ModesMissedError": "Ask for a few modes more, or solve directly instead of by iteration.",
    "QualityGateError": "Keep more modes or finer interfaces; the certificate says which row.",
    "ResourceError": "Use a coarser mesh, another `--solver`, or install what `rom doctor` names.",
    "ParallelError": "Read the message of the first process that failed.",
    "InterruptedRun": "Start again; a motion goes on from its checkpoint.",
}


def demo_page(script: Path, pictures: dict[str, Path]) -> str:
    """A demo as a page: comments at the left margin between blank lines are its text.

    Args:
        script: a demo, of prose in comments and code.
        pictures: files by their names, of those that are there.
    """
    parts = [_pictures(script, pictures)]
    for block in _blocks(script.read_text()):
        prose = all(line.startswith("#") for line in block)
        body = "\n".join(re.sub("^# ?", "", line) if prose else line for line in block)
        parts.append(body if prose else f"```python\n{body}\n```")
    title, _, rest = parts[1].partition("\n")
    return "\n\n".join([title, rest.strip(), parts[0], *parts[2:]]) + "\n"


def _blocks(text: str) -> list[list[str]]:
    """Blocks of comments and of code, code with the blank lines inside it."""
    found: list[list[str]] = []
    for part in re.split(r"\n{2,}", text.strip()):
        lines = part.split("\n")
        comment = all(line.startswith("#") for line in lines)
        if found and not comment and not found[-1][0].startswith("#"):
            found[-1] += ["", *lines]
        else:
            found.append(lines)
    return found


def _pictures(script: Path, pictures: dict[str, Path]) -> str:
    names = list(dict.fromkeys(PICTURE.findall(script.read_text())))
    shown = [f"![{_spoken(name)}]({name})" for name in names if name in pictures]
    absent = [f"`{name}`" for name in names if name not in pictures]
    if absent:
        shown.append(f"Not drawn yet, run the demo to see them: {', '.join(absent)}.")
    return "\n\n".join(shown)


def _spoken(name: str) -> str:
    return Path(name).stem.replace("_", " ").capitalize()


def gallery_page(scripts: list[Path], thumbnails: Path = THUMBNAILS) -> str:
    """All demos: a small picture where there is one, the title, the first paragraph.

    Args:
        scripts: the demos.
        thumbnails: folder of small pictures named as the demos.
    """
    parts = ["# Demos", "Each demo is one script; it ends in numbers that a test checks.\n"]
    parts.append("::::{container} gallery")
    for script in scripts:
        text = "\n".join(_blocks(script.read_text())[0])
        heading, about = (re.sub("^# ?", "", t, flags=re.M) for t in re.split(r"\n#\n", text)[:2])
        title, page = heading.lstrip("# "), f"{script.stem}.md"
        small = thumbnails / f"{script.stem}.png"
        drawn = f"[![{title}](../{thumbnails.name}/{small.name})]({page})\n\n"
        entry = f"{drawn if small.exists() else ''}**[{title}]({page})**\n\n{about}"
        parts.append(f":::{{container}} demo\n{entry}\n:::")
    listed = "\n".join(script.stem for script in scripts)
    return "\n\n".join(parts) + f"\n\n::::\n\n```{{toctree}}\n:hidden:\n\n{listed}\n```\n"


def error_page() -> str:
    """Every error with its exit code, its meaning and what to do, from `rom.errors`."""
    rows = ["| error | exit code | what it is | what to do |", "|---|---|---|---|"]
    kinds = [e for e in vars(errors).values() if inspect.isclass(e) and hasattr(e, "exit_code")]
    for kind in sorted(kinds, key=lambda e: e.exit_code):
        if kind is not errors.RomError:
            meaning = " ".join((kind.__doc__ or "").split())
            rows.append(
                f"| `{kind.__name__}` | {kind.exit_code} | {meaning} | {CURES[kind.__name__]} |"
            )
    return "\n\n".join([
        "# Errors",
        "Everything raised on purpose is a `rom.RomError`. Its message says what happened, with the"
        " number and the name of the culprit, and what to do; `error.where` names the file, body,"
        " joint or interface and `error.hint` the cure; `error.solution` is the part of a"
        " motion, or the last state, that was reached before. The command line turns an error into"
        " one line and an exit code; `--debug` adds the traceback, `--json` gives the error as an"
        " object.",
        "\n".join(rows),
        "`RomWarning` announces something legal that a careful user wants to know; `--strict` makes"
        " it an error.",
        f"```text\n{EXIT_CODES.strip()}\n```",
    ]) + "\n"  # fmt: skip


def command_page() -> str:
    """The help of every verb."""
    parser = build_parser()
    verbs: Any = next(a for a in parser._actions if a.dest == "verb").choices
    parts = ["# Commands", f"```text\n{parser.format_help().strip()}\n```"]
    for name in verb_modules():
        text = verbs[name].format_help().partition("\nexit codes:")[0].strip()
        parts += [f"## rom {name}", f"```text\n{text}\n```"]
    return "\n\n".join(parts) + "\n"


def files_page() -> str:
    """Component and mechanism files, with every key."""
    samples = (ROOT / "meshes" / "connecting_rod.toml", ROOT / "demos" / "slider_crank.toml")
    return page(*(path.read_text() for path in samples))


def answers_page() -> str:
    """What ``--json`` holds, verb by verb."""
    parts = [
        "# Answers for programs",
        "Every verb prints one JSON object with `--json`; `rom VERB --json-schema` prints its"
        " JSON Schema. Numbers that are not finite are null. Every answer also has `ok`, `warnings`"
        " and, where something does not hold, `failed`. An error has these keys instead:",
        _keys(ERROR),
    ]
    for verb in verb_modules():
        schema = answer_of(verb)
        parts += [f"## rom {verb}", f"{schema['description'].capitalize()}.", _keys(schema)]
    return "\n\n".join(parts) + "\n"


def _keys(schema: dict[str, Any]) -> str:
    rows = ["| key | type | meaning |", "|---|---|---|"]
    for path, part in _parts(schema, ""):
        kinds = part.get("type", "")
        kinds = " or ".join(kinds) if isinstance(kinds, list) else kinds
        rows.append(f"| `{path}` | {kinds} | {part['description']} |")
    return "\n".join(rows)


def _parts(schema: dict[str, Any], path: str) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every key below a schema, with its path."""
    for name, part in schema.get("properties", {}).items():
        yield f"{path}{name}", part
        yield from _parts(part, f"{path}{name}.")
    for inner, mark in (
        (schema.get("items"), "[]."),
        (schema.get("additionalProperties"), "NAME."),
    ):
        if isinstance(inner, dict):
            yield from _parts(inner, f"{path.rstrip('.')}{mark if mark == '[].' else '.' + mark}")
    for one in schema.get("anyOf", ()):
        yield from _parts(one, path)


def interface_pages() -> dict[str, str]:
    """One page per part of the package, with its public names; and all names by task."""
    parts: dict[str, list[str]] = {part: [] for part in FURTHER_PARTS}
    for name in rom.__all__:
        parts.setdefault(rom.MODULES[name].split(".")[1], []).append(name)
    pages = {f"rom_{part}.rst": _names(part, names) for part, names in sorted(parts.items())}
    functions = (f".. autofunction:: rom.fe.{name}\n" for name in rom.fe.__all__)
    pages["rom_fe.rst"] = "\n".join([_head("rom.fe"), *functions])
    for name in WHOLE_MODULES:
        pages[f"{name.replace('.', '_')}.rst"] = _modules(name, [name])
    for name, modules in _components().items():
        pages[f"{name.replace('.', '_')}.rst"] = _modules(name, modules)
    listed = "\n".join(f"   {name.removesuffix('.rst')}" for name in pages)
    sections = [_task(*item) for item in TASKS.items()]
    return pages | {
        "interface.rst": "\n".join([
            "Interface\n=========\n",
            "Every public name by what it is for; behind the name stands its docstring.\n",
            *sections,
            f"By package\n----------\n\n.. toctree::\n   :maxdepth: 1\n\n{listed}\n",
        ])
    }  # fmt: skip


def _task(heading: str, about: tuple[str, str]) -> str:
    """A section with the names of a task and the first lines of their docstrings."""
    sentence, names = about
    rows = [f"- {_link(f'rom.{name}')}: {plain(_first_line(f'rom.{name}'))}"
            for name in names.split()]  # fmt: skip
    return "\n".join([heading, "-" * len(heading), "", sentence, "", *rows, ""])


def _link(name: str) -> str:
    if name.startswith("rom.components."):
        return f":doc:`{name} <{name.replace('.', '_')}>`"
    return f":py:obj:`{name} <{_target(name)}>`"


def _target(name: str) -> str:
    """Under which name the site describes it."""
    package, _, short = name.rpartition(".")
    front: dict[str, str] = getattr(importlib.import_module(package), "MODULES", {})
    part = package.rpartition(".")[2]
    if name.startswith("rom.fe."):
        return f"rom.fe.{short}"
    if package == "rom":
        return name if short not in vars(errors) else f"rom.errors.{short}"
    shown = front.get(short, package).removeprefix("rom.")
    return f"rom.{shown}.{short}" if shown in ALSO.get(part, ()) else name


def _first_line(name: str) -> str:
    """Of rom.fe as it is written, for finite elements may be missing where pages are made."""
    package, _, short = name.rpartition(".")
    if package == "rom.fe":
        tree = ast.parse((ROOT / "rom" / "fe" / "elasticity.py").read_text())
        (node,) = (n for n in tree.body if isinstance(n, ast.FunctionDef) and n.name == short)
        text = ast.get_docstring(node)
    else:
        text = inspect.getdoc(getattr(importlib.import_module(package), short))
    return " ".join((text or "").partition("\n\n")[0].split())


def _components() -> dict[str, list[str]]:
    """Modules of every component; those of a package stand on one page."""
    found = {}
    for path in sorted((ROOT / "rom" / "components").iterdir()):
        name = f"rom.components.{path.stem}"
        if path.suffix == ".py" and path.stem not in ("__init__", "compiled"):
            found[name] = [name]
        elif (path / "__init__.py").exists():
            found[name] = [f"{name}.{inside.stem}" for inside in sorted(path.glob("[a-z]*.py"))]
    return found


def _head(name: str) -> str:
    about = (importlib.import_module(name).__doc__ or "").partition("\n\n")[0]
    about = " ".join(about.split()).replace("`", "``").replace("````", "``").replace("*", r"\*")
    return f"{name}\n{'=' * len(name)}\n\n{about}\n"


def _names(part: str, names: list[str]) -> str:
    lines = [_head(f"rom.{part}"), *(_one(rom, name) for name in names)]
    if part in rom.PACKAGES:
        lines += [_one(getattr(rom, part), name) for name in _further(part)]
    for module in ALSO.get(part, ()):
        listed = [name for name in names if rom.MODULES[name] == f"rom.{module}"]
        skip = f"   :exclude-members: {', '.join(listed)}\n" if listed else ""
        lines.append(f".. automodule:: rom.{module}\n{skip}")
    return "\n".join(lines)


def _further(part: str) -> list[str]:
    """Functions and classes of a package that `rom` does not have, and no module in `ALSO`."""
    front = getattr(rom, part)
    own: dict[str, str] = getattr(front, "MODULES", {})
    shown = ALSO.get(part, ())
    further = [
        name for name, place in own.items()
        if place != rom.MODULES.get(name) and place.removeprefix("rom.") not in shown
    ]  # fmt: skip
    return sorted(name for name in further if callable(getattr(front, name)))


def _one(package: ModuleType, name: str) -> str:
    kind = "class" if inspect.isclass(getattr(package, name)) else "function"
    return f".. auto{kind}:: {package.__name__}.{name}\n"


def _modules(title: str, modules: list[str]) -> str:
    lines = [_head(title)]
    for name in modules:
        short = name.rpartition(".")[2]
        lines += [f"{short}\n{'-' * len(short)}\n"] if len(modules) > 1 else []
        lines.append(f".. automodule:: {name}\n")
    return "\n".join(lines)


def write_all(out: Path) -> None:
    """Write every page, and beside them the pictures they show.

    Args:
        out: folder, emptied first.
    """
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    scripts = sorted(DEMOS.glob("demo_*.py"))
    pictures = {p.name: p for folder in reversed(PICTURES) for p in sorted(folder.glob("*.*"))}
    pictures = {name: path for name, path in pictures.items() if PICTURE.fullmatch(name)}
    pages = {f"{s.stem}.md": demo_page(s, pictures) for s in scripts}
    pages |= interface_pages()
    pages["demos.md"] = gallery_page(scripts)
    pages["errors.md"], pages["commands.md"] = error_page(), command_page()
    pages["files.md"], pages["answers.md"] = files_page(), answers_page()
    pages["changelog.md"] = (ROOT / "CHANGELOG.md").read_text()
    for name, text in pages.items():
        (out / name).write_text(text)
    for name, path in pictures.items():
        if any(f"({name})" in text for text in pages.values()):
            shutil.copy(path, out / name)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("builder-inited", lambda app: write_all(Path(app.srcdir) / "generated"))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
