"""The other end of the socket: the mechanism of one FMU instance, asked by its library.

A request is three int32 (verb, number of references, number of values), then the references as
uint32 and the values as doubles. An answer is three int32 (status, number of values, length of the
text), then values and text, which is an error or, with the status OK, a warning. The verbs are
those of ``rom/io/fmu/c/process.c``.
"""

import importlib.util
import json
import socket
import struct
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rom.errors import ConfigError, RomError, RomWarning
from rom.fmu.driven import Driven
from rom.mbs.mechanism import Mechanism
from rom.model import Array, Index

SETTINGS_FILE, BUILD_FUNCTION = "fmu.json", "mechanism"
OK, ERROR = 0, 3
HEAD_LAYOUT = struct.Struct("=iii")
NO_VALUES = np.zeros(0)


def driven(resources: Path) -> Driven:
    """The mechanism that the resources of an FMU describe.

    Raises:
        ConfigError: if the Python file has no function ``mechanism``, or that gives no Mechanism,
            or an input or output is unknown.
    """
    settings = json.loads((resources / SETTINGS_FILE).read_text())
    script = resources / settings["script"]
    sys.path.insert(0, str(script.parent))
    spec: Any = importlib.util.spec_from_file_location(script.stem, script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    build = getattr(module, BUILD_FUNCTION, None)
    if not callable(build):
        raise ConfigError(f"{script.name} needs a function {BUILD_FUNCTION}() for the mechanism.")
    mechanism = build()
    if not isinstance(mechanism, Mechanism):
        raise ConfigError(f"{BUILD_FUNCTION}() gave {mechanism!r}; it must return a Mechanism.")
    names = {key: tuple(settings[key]) for key in ("inputs", "outputs")}
    return Driven(mechanism, **names, dt=settings["dt"], rho_inf=settings["rho_inf"])


class Server:
    """Answers requests about one mechanism.

    Args:
        build: makes the mechanism as it is before the start.
    """

    def __init__(self, build: Callable[[], Driven]):
        self.build, self.model = build, build()
        self.states: dict[int, Any] = {}
        self.count = 0
        self.reported: set[str] = set()
        self.verbs: dict[int, Callable[[Index, Array], Array | None]] = {
            1: lambda refs, values: self.model.set(refs, values),
            2: lambda refs, values: self.model.get(refs),
            3: lambda refs, values: self.model.start(float(values[0])),
            4: lambda refs, values: self.model.step(float(values[0]), float(values[1])),
            5: self._keep,
            6: self._recall,
            7: self._drop,
            8: self._reset,
        }

    def answer(self, verb: int, refs: Index, values: Array) -> tuple[int, Array, str]:
        """Status, values and message; never an exception, for the caller is another program.

        A warning comes once for each instance, as the message of an answer that is OK.
        """
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            try:
                found = self.verbs[verb](refs, values)
            except RomError as error:
                return ERROR, NO_VALUES, str(error)
            except Exception as error:  # whatever the user's own functions raise
                return ERROR, NO_VALUES, f"{type(error).__name__}: {error}"
        new = {str(w.message) for w in caught if issubclass(w.category, RomWarning)} - self.reported
        self.reported |= new
        return OK, NO_VALUES if found is None else found, " ".join(sorted(new))

    def _keep(self, refs: Index, values: Array) -> Array:
        self.count += 1
        self.states[self.count] = self.model.keep()
        return np.array([float(self.count)])

    def _recall(self, refs: Index, values: Array) -> None:
        if int(values[0]) not in self.states:
            raise ConfigError("this state was freed, or of another instance; take a kept one.")
        self.model.recall(self.states[int(values[0])])

    def _drop(self, refs: Index, values: Array) -> None:
        self.states.pop(int(values[0]), None)

    def _reset(self, refs: Index, values: Array) -> None:
        self.model = self.build()


def serve(connection: socket.socket, build: Callable[[], Driven]) -> None:
    """Answer until the other end closes; the first answer says whether the mechanism is there."""
    try:
        server = Server(build)
    except Exception as error:  # the Python file is the user's
        kind = "" if isinstance(error, RomError) else f"{type(error).__name__}: "
        _send(connection, ERROR, NO_VALUES, f"{kind}{error}")
        return
    _send(connection, OK, NO_VALUES, "")
    with connection.makefile("rb") as requests:
        while len(head := requests.read(HEAD_LAYOUT.size)) == HEAD_LAYOUT.size:
            verb, n_refs, n_values = HEAD_LAYOUT.unpack(head)
            size = 4 * n_refs + 8 * n_values
            if len(data := requests.read(size)) < size:
                return
            refs = np.frombuffer(data, np.uint32, n_refs).astype(np.int64)
            values = np.frombuffer(data, float, n_values, 4 * n_refs)
            _send(connection, *server.answer(verb, refs, values))


def _send(connection: socket.socket, status: int, values: Array, text: str) -> None:
    words = text.encode()
    head = HEAD_LAYOUT.pack(status, values.size, len(words))
    connection.sendall(head + np.ascontiguousarray(values, dtype=float).tobytes() + words)
