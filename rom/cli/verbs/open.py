"""Show a part in the browser: click its faces, choose, and let it swing.

The page comes from this machine and is seen on this machine alone; when it is closed, the program
ends, and with it whatever still runs. What is chosen is written as a component file, and
`rom swing` takes it from there: the page can nothing that the command line cannot.
"""

import argparse
import logging
import os
import shlex
import threading
import webbrowser
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any

from rom.cli.answer import Answer
from rom.cli.described import described
from rom.cli.options import add_file, add_meshing, option, reading
from rom.cli.output import add_force, checked, claim, usual
from rom.errors import ConfigError, QualityGateError
from rom.process import child

log = logging.getLogger("rom")
SUMMARY = "choose faces of a part in the browser and let it swing"
EXAMPLES = """\
  rom open part.step
  rom open part.step -o first --no-browser     # the address is for a browser of your choice
"""
BOUNDS = {"E": (1e-9, 1e6), "nu": (-1.0, 0.5), "rho": (1e-6, 1e6), "size": (1e-6, 1e6)}
MAX_NAME = 64  # letters


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    add_file(parser)
    add_meshing(parser)
    parser.set_defaults(face=[], scale=1.0, order=None)
    option(parser, "--no-browser", "say the address only")
    option(parser, "-o --output", "folder, made if missing (default PART_open)", Path)
    add_force(parser)


def run(args: argparse.Namespace) -> Answer:
    """Serve the page until it is closed."""
    if described(args):
        raise ConfigError("a component file says already what is chosen; rom swing moves it.")
    args.output = usual(args, "_open")
    from rom.fe.mesh.picks import EVERY_FACE
    from rom.fe.mesh.read import read_mesh
    from rom.fe.mesh.summary import surface_triangles
    from rom.process.loopback import Loopback
    from rom.report.part import known_faces, part_page

    how = reading(args)
    given = {"units": how["units"]} if how["units"] != "SI" else {}
    if args.file.suffix.lower() in (".step", ".stp"):
        how["faces"] = {"face": EVERY_FACE}
    mesh = read_mesh(args.file, **how)
    patches = surface_triangles(mesh)
    faces = known_faces(filter(None, patches), map(asdict, mesh.faces))
    page = part_page(mesh.points, patches, faces, args.file.name).encode()
    file = checked(args, claim(args) / f"{args.file.stem}.toml")
    limits = ["--trust"] * args.trust
    for name in ("time_limit", "memory_limit"):
        value = getattr(args, name)
        limits += [] if value is None else [f"--{name.replace('_', '-')}={value!r}"]
    chosen = Chosen(args.file, given, how["parameters"], faces, file, limits)
    orders = {"swing": chosen.swing, "save": chosen.save, "stop": chosen.stop}
    server = Loopback(lambda name: page if not name else chosen.report(name), orders)
    chosen.tell = server.tell
    log.info("open %s", server.address)
    if not args.no_browser:
        with suppress(webbrowser.Error):
            webbrowser.open(server.address)
    try:
        server.until_closed()
    finally:
        chosen.stop({})
    return Answer({"files": [*map(str, chosen.files)]}, "\n".join(map(str, chosen.files)))


@dataclass(slots=True)
class Chosen:
    """What the page may ask for: the file of what is chosen, and one swing at a time."""

    part: Path
    given: dict[str, str]  # more of its geometry
    parameters: dict[str, float | str]  # of its geometry
    faces: dict[str, dict[str, object]]  # that there are, by their labels
    file: Path  # of the component
    limits: list[str]  # options for all that meshes it
    tell: Any = None  # tells the page
    files: list[Path] = field(default_factory=list)
    process: child.Child | None = None
    lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def folder(self) -> Path:
        """Of the swing."""
        return self.file.with_suffix("")

    def report(self, name: str) -> bytes | None:
        """The report of the last swing, by the name of its file."""
        path = self.folder / f"{self.part.stem}.html"
        return path.read_bytes() if name == path.name and path in self.files else None

    def save(self, asked: dict[str, Any]) -> dict[str, str]:
        """Write the component file; the command that swings it."""
        from rom.io.files import write_whole
        from rom.report.part import component_text

        faces, hinge = self._faces(asked), asked.get("hinge")
        if hinge not in faces:
            raise ConfigError("no face is chosen that the part hangs on.")
        numbers = {key: _number(asked, key) for key in BOUNDS if key != "size" or asked.get(key)}
        size = numbers.pop("size", None)
        parameters = self.parameters | ({"lc": f"{size:g} mm"} if size else {})
        geometry = {"file": os.path.relpath(self.part, self.file.parent)} | self.given
        text = component_text(geometry, parameters, faces, hinge, numbers)
        write_whole(self.file, text.encode())
        self._keep(self.file)
        return {"file": str(self.file), "command": shlex.join(["rom", *self._swing(hinge)])}

    def swing(self, asked: dict[str, Any]) -> dict[str, str]:
        """Write the file and start its swing."""
        with self.lock:
            if self.process is not None:
                raise ConfigError("it swings already; stop it first.")
            saved, started = self.save(asked), threading.Event()
            self.tell(began=saved["command"])
            command = child.python("rom", *self._swing(asked["hinge"]))
            threading.Thread(target=self._follow, args=(command, started), daemon=True).start()
            started.wait()
        return saved

    def stop(self, _: dict[str, Any]) -> dict[str, str]:
        """End the swing, if there is one."""
        if process := self.process:
            child.end(process)
        return {}

    def _swing(self, hinge: str) -> list[str]:
        return ["swing", str(self.file), "--hinge", hinge, "-o", str(self.folder), *self.limits]

    def _follow(self, command: list[str], started: threading.Event) -> None:
        """Start a swing, tell the page what it says, and how it ended.

        In one thread: the system ends a child with the thread that has started it.
        """
        try:
            process = self.process = child.start(command)
        except OSError as error:
            self.tell(ended=f"it cannot be started: {error.strerror}", failed=True)
            return
        finally:
            started.set()
        assert process.stdout is not None and process.stderr is not None
        for line in process.stderr:
            self.tell(line=line.decode(errors="replace").rstrip())
        said = process.stdout.read().decode(errors="replace").rstrip()
        ended = child.Ended(process.wait(), said)
        self.process = None
        path = self.folder / f"{self.part.stem}.html"
        if ended.code not in (0, QualityGateError.exit_code):
            self.tell(ended=f"ended by {ended.signal or f'exit code {ended.code}'}", failed=True)
            return
        self._keep(path)
        self.tell(ended=said, failed=bool(ended.code), report=path.name)

    def _keep(self, path: Path) -> None:
        self.files += [path] if path not in self.files else []

    def _faces(self, asked: dict[str, Any]) -> dict[str, str]:
        """{name: face as files pick it}, looked at."""
        given = asked.get("faces")
        if not isinstance(given, dict) or not given:
            raise ConfigError("no face is chosen.")
        found = {}
        for name, label in given.items():
            if not name or len(name) > MAX_NAME or not name.isprintable():
                raise ConfigError(f"a face needs a name of at most {MAX_NAME} letters.")
            if not isinstance(label, str) or label not in self.faces:
                raise ConfigError(f"there is no face {str(label)[:MAX_NAME]!r}.")
            fixed = self.faces[label]["fixed"]
            found[name] = label if fixed else label.removeprefix("face ")
        return found


def _number(asked: dict[str, Any], key: str) -> float:
    low, high = BOUNDS[key]
    try:
        value = float(str(asked.get(key)).replace(",", "."))
    except ValueError:
        value = float("nan")
    if not (isfinite(value) and low <= value <= high):
        raise ConfigError(
            f"{key} = {str(asked.get(key))[:MAX_NAME]} must be from {low:g} to {high:g}."
        )
    return value
