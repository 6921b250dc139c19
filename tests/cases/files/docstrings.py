"""What is public, with its docstrings in parts; pages, demos and their commands."""

import ast
import importlib.util
import inspect
import re
import shlex
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import rom
from cases.paths import ROOT

# fronts that only other packages read, for they hold parts of what others show
INSIDE = {"rom.fe.mesh", "rom.io.sid", "rom.mbs.integrate", "rom.mbs.parts", "rom.report"}
MODULES = ("rom.rotation", "rom.units")  # whose functions are public without a front
SECTION = re.compile(r"^(Args|Attributes|Returns|Raises|Warns|Source|Example):$", re.M)


@dataclass(eq=False)
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
    def whole(self):
        """Its docstring and those of the classes it is derived from."""
        return "\n".join((*self.inherited, self.text))


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
