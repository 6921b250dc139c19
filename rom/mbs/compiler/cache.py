"""Where compiled code of kernels is kept, and who compiles it.

Numba keeps compiled code beside the source and notices when that file changes, but not when
another file changes whose functions or layouts were built in. Therefore what it keeps says from
which sources it was made; code of others is never loaded, wherever Numba keeps it. Of several
processes one compiles what the others wait for, and who waits is told so.
"""

import functools
import gc
import hashlib
import os
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

import numba
from numba.core.caching import Cache, IndexDataCacheFile
from numba.core.ccallback import CFunc
from numba.core.compiler_lock import global_compiler_lock
from numba.core.dispatcher import Dispatcher

from rom.places import PACKAGE
from rom.process.child import lasting_scratch, trusted
from rom.process.patience import Patience, Turns

T = TypeVar("T")
Function = Callable[..., object]  # in Python
Compiler = Callable[[Function], Dispatcher]  # a decorator of Numba
IMPORTS = re.compile(rb"^from (rom[.\w]*) import (\([^)]*\)|.*)", re.MULTILINE)
NAMES, OWNERS = re.compile(rb"(\w+)(?: as (\w+))?"), re.compile(rb"\b(\w+)\.[A-Z][A-Z\d_]*\b")
# in sources of kernels, and the folders of what they contain and are made by
KERNEL_MARK, LAYOUT_FOLDERS = b"compiled import", {"kernels", "compiler"}
COMPILE_RATE = 2.5e-4  # [s] of compiling per byte of functions in Python; 2.3e-4 measured
COMPILE_TURNS, COMPILE_PATIENCE = Turns(), Patience(COMPILE_RATE)
AHEAD_HINT = "rom doctor --compile compiles all ahead"
WAIT_SENTENCE = "another process compiles what this one needs: waiting for it"
CODE_FILES: dict[Function, "CodeFiles"] = {}  # of the functions in Python
EXPECTED_FUNCTIONS: set[Function] = set()  # those that will be called, as far as is known
COMPILED_FUNCTIONS: list[Function] = []  # by this process, none taken from a file


class CodeFiles(IndexDataCacheFile):  # type: ignore[misc]
    """Where compiled code of one function is kept, made by one process at a time.

    Numba counts the files of code and writes the index first: two processes that add signatures
    would give both the same number, and a reader between index and code would run that of older
    sources. Here no two codes share a name, and an index names only what is there.
    """

    def __init__(self, cache: Cache, function: Function):
        made_of = f"Numba {numba.__version__}, {digest(Path(function.__code__.co_filename))}"
        name = f"{cache._impl.filename_base}.numba-{numba.__version__}"
        super().__init__(cache._cache_path, name, made_of)
        self._version = made_of  # compared before anything else is read
        self.path, self.function = Path(self._index_path), function

    def _load_index(self) -> dict[object, str]:
        safe = trusted(self.path.parent) and trusted(self.path)
        return super()._load_index() if safe else {}

    def _load_data(self, name: str) -> object:
        if not trusted(self.path.parent / name):
            raise PermissionError(f"others may have written {name}")  # Numba compiles it anew
        return super()._load_data(name)

    def load(self, key: object) -> object:
        """Compiled code, if need be of a process that makes it just now; None to make it."""
        found = super().load(key)
        if found is not None:
            return found
        if not COMPILE_TURNS.take(self.path, wait=False):
            with COMPILE_PATIENCE.blocked(WAIT_SENTENCE):
                COMPILE_TURNS.take(self.path)
        found = super().load(key)
        if found is None:
            COMPILE_PATIENCE.begin()
        else:
            COMPILE_TURNS.end(self.path)
        return found

    def save(self, key: object, data: object) -> None:
        """Keep compiled code, and drop that of other sources."""
        known = self._load_index()
        made_of = hashlib.sha256(f"{self._source_stamp} {key}".encode()).hexdigest()
        known[key] = f"{self.path.stem}.{made_of[:16]}.nbc"
        self._save_data(known[key], data)
        self._save_index(known)
        for path in self.path.parent.glob(f"{self.path.stem}.*.nbc"):
            if path.name not in known.values():
                path.unlink(missing_ok=True)
        COMPILE_TURNS.end(self.path)
        COMPILED_FUNCTIONS.append(self.function)
        COMPILE_PATIENCE.advance(_size(self.function), _size_of_rest, self._foretold)

    def full(self) -> bool:
        """Whether some process has left compiled code."""
        return bool(self._load_index())

    def made_elsewhere(self) -> bool:
        """Whether another process compiles the function just now."""
        free = COMPILE_TURNS.take(self.path, wait=False)
        COMPILE_TURNS.end(self.path)
        return not free

    def _foretold(self, seconds: int) -> str:
        package = ".".join(self.function.__module__.split(".")[:2])
        often = f"this once: the code is kept in {self.path.parent} ({AHEAD_HINT})"
        if numba.config.CACHE_DIR != os.environ.get("NUMBA_CACHE_DIR", ""):
            often = "in each run, as no folder can be written: set NUMBA_CACHE_DIR to one"
        return f"compiling {package} for this machine takes about {seconds} s more, {often}"


def kept(compiler: Compiler, *, entry: bool = False) -> Compiler:
    """A decorator of Numba whose cache knows the sources that a function is made of.

    ``entry``: whether its functions are called wherever mechanisms are.
    """

    def compiled(function: Function) -> Dispatcher:
        dispatcher = _with_a_place(compiler, function)
        if not numba.config.DISABLE_JIT:
            guard(dispatcher, function)
            if entry:
                EXPECTED_FUNCTIONS.add(function)
        return dispatcher

    return compiled


def _with_a_place(compiler: Compiler, function: Function) -> Dispatcher:
    """What Numba compiles a function by; where no safe folder can be written, code is not kept."""
    try:
        made = compiler(function)
        if numba.config.DISABLE_JIT or trusted(Path(made._cache._cache_path)):
            return made
        raise RuntimeError("others may write where code is kept")
    except RuntimeError:
        numba.config.CACHE_DIR = str(lasting_scratch("code"))
        return compiler(function)


def guard(made: Dispatcher | CFunc, function: Function) -> None:
    """Let Numba load only what the present sources and version of Numba have made of a function."""
    compile_it = made.compile

    def in_turn(*signature: object) -> object:
        with _at_work(function):
            return compile_it(*signature)

    made.compile = in_turn
    CODE_FILES[function] = made._cache._cache_file = CodeFiles(made._cache, function)


_under_way: list[Function] = []  # functions that are compiled, each for the one before it


@contextmanager
def _at_work(function: Function) -> Iterator[None]:
    """Around a compilation, within which others may be; when all have ended, nothing is held.

    Numba makes many small objects and no circles of them: to look for such takes 2 s of 15.
    """
    with global_compiler_lock:
        collects = gc.isenabled()
        gc.disable()
        _under_way.append(function)
        try:
            yield
        finally:
            _under_way.pop()
            if collects:
                gc.enable()
            if not _under_way:
                COMPILE_TURNS.end_all()
                COMPILE_PATIENCE.end()


def _size(function: Function) -> int:
    """What the time to compile a function grows with: its code in Python, and what it takes in."""
    taken_in = _reached([function], lambda one: [x for x in _called(one) if x not in CODE_FILES])
    return sum(len(one.__code__.co_code) for one in taken_in)


def _size_of_rest() -> int:
    """Of all functions that are expected, and those they call, what no process has compiled."""
    found = _reached([*EXPECTED_FUNCTIONS, *_under_way], _called)
    return sum(_size(f) for f in found if f in CODE_FILES and not CODE_FILES[f].full())


def _reached(first: list[T], near: Callable[[T], Iterable[T]]) -> set[T]:
    """What steps to what is near lead to, and where they begin."""
    found: set[T] = set()
    while first:
        one = first.pop()
        if one not in found:
            found.add(one)
            first += near(one)
    return found


def _called(function: Function) -> list[Function]:
    """The compiled functions that a function names, as Python knows them."""
    known = function.__globals__
    named = (known[name] for name in function.__code__.co_names if name in known)
    return [x.py_func for x in named if hasattr(x, "py_func")]


@functools.cache
def digest(source: Path) -> str:
    """Of a source and all that its kernels are made of."""
    found = sorted(_reached([source], lambda path: _read(path)[1]))
    return hashlib.sha256(b"".join(_read(path)[0] for path in found)).hexdigest()


@functools.cache
def _read(source: Path) -> tuple[bytes, tuple[Path, ...]]:
    """The text of a source, and the files with kernels, layouts or constants that it imports."""
    text = source.read_bytes()
    paths, built_in, owners = set(), set(), set(OWNERS.findall(text))
    for module, names in IMPORTS.findall(text):
        place = PACKAGE.joinpath(*module.decode().split(".")[1:])
        for word, alias in NAMES.findall(names):
            path = place / f"{word.decode()}.py"
            paths |= {path, place.with_suffix(".py")}
            if word.isupper():
                built_in.add(place.with_suffix(".py"))
            if (alias or word) in owners:
                built_in.add(path)
    found = (path for path in paths if path.is_file() and (path in built_in or _has_kernels(path)))
    return text, tuple(sorted(found))


@functools.cache
def _has_kernels(path: Path) -> bool:
    return path.parent.name in LAYOUT_FOLDERS or KERNEL_MARK in path.read_bytes()
