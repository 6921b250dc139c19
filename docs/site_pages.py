"""Pages made from the project itself: demos, pictures, errors, commands, the public interface.

They are written below ``generated/`` beside this file whenever the site is built, so that none of
them can be out of date.
"""

import importlib
import inspect
import re
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from site_tasks import FILE_NAMES, NAMES, SUBJECTS, TASKS
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


def gallery_page(thumbnails: Path = THUMBNAILS) -> str:
    """All demos by subject: a small picture where there is one, the title, the first paragraph.

    Args:
        thumbnails: folder of small pictures named as the demos.
    """
    parts = ["# Demos", "Each demo is one script; it ends in numbers that a test checks."]
    for subject, names in SUBJECTS.items():
        parts += [f"## {subject}", "::::{grid} 1 2 2 3\n:gutter: 3"]
        for stem in (f"demo_{name}" for name in names.split()):
            text = "\n".join(_blocks((DEMOS / f"{stem}.py").read_text())[0])
            heading, about = (re.sub("^# ?", "", t, flags=re.M) for t in text.split("\n#\n")[:2])
            card = f":::{{grid-item-card}} {heading.lstrip('# ')}\n:link: {stem}\n:link-type: doc\n"
            if (thumbnails / f"{stem}.png").exists():
                card += f":img-top: ../{thumbnails.name}/{stem}.png\n"
            parts.append(f"{card}\n{about}\n:::")
        parts.append("::::")
    listed = "\n".join(f"demo_{name}" for names in SUBJECTS.values() for name in names.split())
    return "\n\n".join([*parts, f"```{{toctree}}\n:hidden:\n\n{listed}\n```\n"])


def error_page() -> str:
    """Every error with its exit code, its meaning and what to do, from `rom.errors`."""
    rows = ["| error | exit code | what it is | if its message has no cure |", "|---|---|---|---|"]
    every = (e for e in vars(errors).values() if inspect.isclass(e))
    kinds = [e for e in every if issubclass(e, errors.RomError)]
    for kind in sorted(kinds, key=lambda e: e.exit_code):
        if kind is not errors.RomError:
            meaning = " ".join((kind.__doc__ or "").split())
            rows.append(f"| `{kind.__name__}` | {kind.exit_code} | {meaning} | {kind.advice} |")
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
    """The reference: a page for each task, whose table leads to one page for each name."""
    pages = {
        f"task_{task.lower().replace(' ', '_')}.rst": "\n".join([
            task, "=" * len(task), "", sentence, "", _table(names.split(), "   :toctree: api\n")
        ])
        for task, (sentence, names) in TASKS.items()
        if task != "Components"
    }  # fmt: skip
    tasks = [name.removesuffix(".rst") for name in pages]
    components = _components()
    for name, modules in components.items():
        pages[f"{name.replace('.', '_')}.rst"] = _modules(name, modules)
    for package, names in _packages().items():
        pages[f"rom_{package}.rst"] = _head(f"rom.{package}") + "\n" + _table(names)
    rest = ("commands", "files", "answers", "errors", "/conventions", "/glossary")
    by_package = sorted(name.removesuffix(".rst") for name in pages if name.startswith("rom_"))
    return pages | {
        "interface.rst": "\n".join([
            "Reference\n=========\n",
            "Every public name of ``rom`` by what it is for; each has a page with its arguments,"
            " their types and units, what it returns and what it raises.\n",
            _listed("By task", tasks),
            _listed("Command line, files and words", rest),
            _listed("By package", by_package),
        ])
    }  # fmt: skip


def _listed(heading: str, pages: Iterable[str]) -> str:
    lines = "\n".join(f"   {page}" for page in pages)
    return f".. toctree::\n   :caption: {heading}\n   :maxdepth: 1\n\n{lines}\n"


def _table(names: Iterable[str], option: str = "") -> str:
    """Names below rom with the first sentences of their docstrings."""
    lines = "\n".join(f"   rom.{name}" for name in names)
    return f".. autosummary::\n   :nosignatures:\n   :template: base.rst\n{option}\n{lines}\n"


def _packages() -> dict[str, list[str]]:
    """Public names by the package in which they lie."""
    found: dict[str, list[str]] = {}
    for name in (name for _, names in TASKS.values() for name in names.split()):
        package, _, short = name.rpartition(".")
        if package != "components":
            found.setdefault(package or rom.MODULES[short].split(".")[1], []).append(name)
    return found


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


def _modules(title: str, modules: list[str]) -> str:
    lines = [_head(title)]
    for name in modules:
        short = name.rpartition(".")[2]
        lines += [f"{short}\n{'-' * len(short)}\n"] if len(modules) > 1 else []
        lines.append(f".. automodule:: {name}\n")
    return "\n".join(lines)


def write_all(out: Path) -> None:
    """Write every page that has changed, and beside them the pictures they show.

    Args:
        out: folder; what no page or picture of today is called goes.
    """
    out.mkdir(parents=True, exist_ok=True)
    scripts = sorted(DEMOS.glob("demo_*.py"))
    pictures = {p.name: p for folder in reversed(PICTURES) for p in sorted(folder.glob("*.*"))}
    pictures = {name: path for name, path in pictures.items() if PICTURE.fullmatch(name)}
    pages = {f"{s.stem}.md": demo_page(s, pictures) for s in scripts}
    pages |= interface_pages()
    pages["demos.md"] = gallery_page()
    pages["errors.md"], pages["commands.md"] = error_page(), command_page()
    pages["files.md"], pages["answers.md"] = files_page(), answers_page()
    pages["changelog.md"] = (ROOT / "CHANGELOG.md").read_text()
    shown = {name for name in pictures if any(f"({name})" in text for text in pages.values())}
    for name in shown:
        shutil.copy2(pictures[name], out / name)
    for name, text in pages.items():
        if not (out / name).exists() or (out / name).read_text() != text:
            (out / name).write_text(text)
    names = {f"{FILE_NAMES.get(name, name)}.rst" for name in NAMES}
    for path in out.rglob("*.*"):  # autosummary writes the pages of single names
        if path.name not in shown | set(pages) | names:
            path.unlink()


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("config-inited", lambda app, _: write_all(Path(app.srcdir) / "generated"))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
