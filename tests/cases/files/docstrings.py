"""What is public, with its docstrings in parts and the errors that its code raises."""

import ast
import builtins
import importlib.util
import inspect
import re
import shlex
import textwrap
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import rom
from cases.paths import ROOT
from rom import errors

# fronts that only other packages read, for they hold parts of what others show
INSIDE = {"rom.fe.mesh", "rom.io.sid", "rom.mbs.integrate", "rom.mbs.parts", "rom.report"}
MODULES = ("rom.rotation", "rom.units")  # whose functions are public without a front
SECTION = re.compile(r"^(Args|Attributes|Returns|Raises|Warns|Source|Example):$", re.M)


@dataclass
class Callable:
    """What is public, with its docstring in parts."""

    name: str
    thing: object
    text: str
    items: dict[str, str] = field(default_factory=dict)  # {argument or field: its annotation}
    result: str = ""
    inherited: tuple[str, ...] = ()  # docstrings of the classes a class is derived from

    @property
    def sections(self):
        parts = SECTION.split(self.text)
        return dict(zip(["", *parts[1::2]], [parts[0], *parts[2::2]], strict=True))

    @property
    def entries(self):
        """{name: what Args or Attributes say of it}, of classes it is derived from too."""
        found = {}
        for text in (*self.inherited, self.text):
            parts = SECTION.split(text)
            for key, part in zip(parts[1::2], parts[2::2], strict=True):
                for entry in re.split(r"\n(?=\S)", textwrap.dedent(part.strip("\n"))):
                    names, _, about = entry.partition(":")
                    if key in ("Args", "Attributes"):
                        found |= {n.strip(" *`"): about for n in names.split(",")}
        return found

    def said_of(self, name):
        about = self.entries.get(name)
        return " ".join((self.sections[""] if about is None else about).split())

    @property
    def raises_said(self):
        """What it says of errors, and the classes it is derived from."""
        texts = (*self.inherited, self.text)
        return [one.sections.get("Raises", "") for text in texts for one in [Callable("", 0, text)]]

    @property
    def said_of_result(self):
        return " ".join((self.sections.get("Returns", "") or self.sections[""]).split())


# --- what is public ---


@cache
def fronts():
    paths = sorted((ROOT / "rom").rglob("__init__.pyi"))
    named = {".".join(path.parent.relative_to(ROOT).parts): path for path in paths}
    return {package: path for package, path in named.items() if package not in INSIDE}


@cache
def public():
    """{full name: callable}, each once whatever fronts show it."""
    found = {}
    for path in fronts().values():
        for line in ast.parse(path.read_text()).body:
            if isinstance(line, ast.ImportFrom) and line.module != "typing":
                module = importlib.import_module(line.module)
                found |= {f"{line.module}.{a.name}": getattr(module, a.name, None)
                          for a in line.names}  # fmt: skip
    if importlib.util.find_spec("dolfinx"):
        found |= {f"rom.fe.{name}": getattr(rom.fe, name) for name in rom.fe.__all__}
    for name in MODULES:
        inside = vars(importlib.import_module(name)).items()
        found |= {f"{name}.{k}": x for k, x in inside
                  if k[0] != "_" and getattr(x, "__module__", "") == name}  # fmt: skip
    return {
        one.name: one
        for name, thing in found.items()
        if is_documented(thing)
        for one in with_members(name, thing)
    }


def is_documented(thing):
    """A function or a class; errors have a page of their own."""
    is_class = inspect.isclass(thing) and not issubclass(thing, Exception)
    return is_class or inspect.isfunction(thing)


def with_members(name, thing):
    if not inspect.isclass(thing):
        yield of_function(name, thing)
        return
    yield of_class(name, thing)
    for key, member in members(thing):
        if isinstance(member, property):
            one = of_function(f"{name}.{key}", member.fget)
            yield Callable(one.name, one.thing, one.text, {}, one.result)
        elif inspect.isfunction(function := getattr(member, "__func__", member)):
            yield of_function(f"{name}.{key}", function)


def members(cls):
    """Methods and properties; a function that is the default of a field is none."""
    fields = getattr(cls, "__dataclass_fields__", {})
    for base in cls.__mro__:
        if base.__module__.startswith("rom."):
            for key, member in vars(base).items():
                own = key not in fields and not key.startswith("_")
                if own and getattr(cls, "__dict__", {}).get(key, member) is member:
                    yield key, member


def of_function(name, function):
    function = inspect.unwrap(function)
    node = tree(function)
    arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    items = {a.arg: ast.unparse(a.annotation) for a in arguments if a.annotation}
    result = ast.unparse(node.returns) if node.returns else ""
    return Callable(name, function, inspect.cleandoc(function.__doc__ or ""), items, result)


def of_class(name, cls):
    items = {}
    for base in reversed(cls.__mro__):
        if base.__module__.startswith("rom."):
            for line in tree(base).body:
                if isinstance(line, ast.AnnAssign) and line.target.id[0] != "_":
                    items[line.target.id] = ast.unparse(line.annotation)
                if isinstance(line, ast.FunctionDef) and line.name == "__init__":
                    items = of_function(name, vars(base)["__init__"]).items
    above = tuple(inspect.cleandoc(base.__doc__ or "") for base in reversed(cls.__mro__[1:]))
    return Callable(name, cls, inspect.cleandoc(cls.__doc__ or ""), items, inherited=above)


def tree(thing):
    """Where a function or class is defined; of several definitions, as of overloads, the last."""
    code = getattr(thing, "__code__", None)
    path = code.co_filename if code else importlib.import_module(thing.__module__).__file__
    return definitions(Path(path))[thing.__qualname__]


@cache
def definitions(path):
    """{qualified name: definition} of a file."""
    found = {}

    def enter(node, above):
        for child in node.body:
            if isinstance(child, ast.FunctionDef | ast.ClassDef):
                found[above + child.name] = child
                if isinstance(child, ast.ClassDef):
                    enter(child, f"{above}{child.name}.")

    enter(ast.parse(path.read_text()), "")
    return found


# --- errors ---


def bodies(thing):
    """Functions whose bodies run when a thing is called."""
    if not inspect.isclass(thing):
        return [inspect.unwrap(thing)]
    return [inspect.unwrap(vars(base)[name]) for base in thing.__mro__
            if base.__module__.startswith("rom.")
            for name in ("__init__", "__post_init__", "__new__")
            if inspect.isfunction(vars(base).get(name))
            and "rom" in inspect.unwrap(vars(base)[name]).__code__.co_filename]  # fmt: skip


@cache
def raised(thing):
    """Names of the errors that the body of a function, or of what makes an object, raises."""
    names = {
        getattr(made, "id", "")
        for body in bodies(thing) if not body.__code__.co_filename.startswith("<")
        for line in ast.walk(tree(body)) if isinstance(line, ast.Raise) and line.exc
        for made in ast.walk(line.exc)
    }  # fmt: skip
    kinds = {name: getattr(errors, name, getattr(builtins, name, None)) for name in names}
    return {n for n, kind in kinds.items() if inspect.isclass(kind) and issubclass(kind, Exception)}


# --- what users read ---


PAGES = [path for path in (ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md")))
         if "generated" not in path.parts]  # fmt: skip
DEMOS = sorted((ROOT / "demos").glob("*.py"))


def pages_and_demos():
    """All text of README, pages and demos; not the pages that are made of these."""
    return "\n".join(path.read_text() for path in (*PAGES, *DEMOS))


def commands(page):
    """Lines of the blocks of a page, with what goes over several in one."""
    blocks = re.findall(r"^```(?:sh|bash|console)\n(.*?)^```$", page.read_text(), re.M | re.S)
    text = "".join(blocks).replace("\\\n", " ")
    words = (shlex.split(line, comments=True) for line in text.splitlines())
    return [shlex.join(line) for line in words if line]
