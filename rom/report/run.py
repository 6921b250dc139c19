"""A run of a mechanism file: the motion, and the folder it is kept in."""

import hashlib
import json
import platform
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rom.config.keys import Place, nearest
from rom.config.mechanism import MechanismFile
from rom.config.python_files import python_entries

if TYPE_CHECKING:
    from rom.mbs.integrate.keeping import Keeping
    from rom.mbs.mechanism import Mechanism
    from rom.mbs.results.solution import Solution
    from rom.model import Report

RECORD_FILE, SCENE_FILE = "run.json", "scene.json"


@dataclass(frozen=True, slots=True)
class Record:
    """How a run came about: what `rom report` tells of it later."""

    name: str  # of the mechanism
    command: str  # what was typed
    version: str  # of rom
    source: str = ""  # the file that describes it; empty without one

    def write(self, paths: list[Path], solution: "Solution", audit: "Report") -> None:
        """Write it as the last of the files of a run."""
        from rom.io.files import write_whole

        files = [path.name for path in paths]
        text = json.dumps(self._data(files, solution, audit), indent=2)
        write_whole(paths[-1], text.encode())

    def _data(self, files: list[str], solution: "Solution", audit: "Report") -> dict[str, Any]:
        parts, joints = solution.mechanism.parts.items(), solution.mechanism.joints.items()
        return {
            "schema": "rom-run",
            "version": [1, 0],
            "name": self.name,
            "command": self.command,
            "versions": {"rom": self.version} | versions(),
            "source": self.source,
            "files": files,
            "status": solution.status,
            "steps": len(solution.t) - 1,
            "t_end": float(solution.t[-1]),
            "bodies": {
                name: {"mass": float(p.mass), "elastic coordinates": p.r, "markers": list(p.names)}
                for name, p in parts
            },
            "joints": {name: joint.kind for name, joint in joints},
            "events": happened(solution),
            "audit": {
                "title": audit.title,
                "rows": [[r.quantity, float(r.value), r.limit, bool(r.ok)] for r in audit.rows],
            },
        }


@dataclass(frozen=True, slots=True)
class Run:
    """A motion and what is to be kept of it."""

    file: MechanismFile
    solution: "Solution"
    audit: "Report"  # whether it is to be believed
    command: str = ""  # what was typed
    version: str = ""  # of rom

    def paths(self, folder: Path) -> list[Path]:
        """The files to be written, the table of the motion first."""
        return paths_of(self.file, folder)

    def write(self, folder: Path) -> None:
        """Write them; the folder is made if it is missing.

        Pictures come last, so that the motion is there whatever becomes of them.
        """
        paths = self.paths(folder)
        self.write_motion(paths)
        self._draw(paths)
        self._scene(paths[-2])

    def write_motion(self, paths: list[Path]) -> None:
        """Write the table of the motion, then the record, the last of the paths."""
        from rom.io.history import write_history

        paths[0].parent.mkdir(exist_ok=True)
        write_history(self.solution, paths[0])
        source = self.file.document.path.read_text(encoding="utf-8")
        record = Record(self.file.name, self.command, self.version, source)
        record.write(paths, self.solution, self.audit)

    def _draw(self, paths: list[Path]) -> None:
        out, solution = self.file.values["output"], self.solution
        how = look_of(self.file) | {"magnify": out["magnify"]}
        for path in paths:
            if path.name == "curves.png":
                self._curves(path)
            elif path.name == "instants.png":
                from rom.view.scenes.film import instants

                instants(solution.mechanism, solution, path, **how)
            elif path.suffix in (".gif", ".mp4"):
                from rom.view.scenes.film import animate

                animate(solution.mechanism, solution, path, **how)
            elif path.suffix in (".glb", ".vtkhdf"):
                from rom.view.scenes.animation_files import write_animation

                write_animation(solution, path, magnify=out["magnify"], up=out.get("up"))

    def _scene(self, path: Path) -> None:
        from rom.report.scene import motion_scene
        from rom.report.scene_file import write_scene

        title, magnify = f"Motion of {self.file.name}", self.file.values["output"]["magnify"]
        look = look_of(self.file)
        write_scene(motion_scene(self.solution, title=title, magnify=magnify, **look), path)

    def _curves(self, path: Path) -> None:
        from rom.view.figures.curves import history

        panels: dict[str, dict[str, Any]] = {}
        found = columns(self.solution)
        for name in self.file.values["output"]["plot"]:
            panels.setdefault(found[name][0], {})[name] = found[name][1]
        title = f"Motion of {self.file.name}"
        groups = [(f"[{unit}]", curves) for unit, curves in panels.items()]
        caption = (
            f"Histories of {self.file.name} over {self.solution.t[-1]:g} s, one panel for each "
            "unit; names as in the table of the motion."
        )
        history(self.solution.t, groups, path, title=title, caption=caption)


def paths_of(file: MechanismFile, folder: Path) -> list[Path]:
    """The files that a run of a mechanism file writes, the table of the motion first."""
    out = file.values["output"]
    names = [f"motion.{out['history']}"]
    names += ["instants.png"] if out["picture"] else []
    names += ["curves.png"] if out["plot"] else []
    names += [f"motion.{out['film']}"] if "film" in out else []
    return [folder / name for name in [*names, SCENE_FILE, RECORD_FILE]]


def look_of(file: MechanismFile) -> dict[str, Any]:
    """From where pictures of a mechanism file are seen, as far as it says."""
    return {key: x for key, x in file.values["output"].items() if key in ("view", "up")}


def happened(solution: "Solution") -> dict[str, list[float]]:
    """When each event happened [s], by name."""
    return {name: [float(t) for t in found.t] for name, found in solution.events.items()}


def columns(solution: "Solution") -> dict[str, tuple[str, Any]]:
    """Unit and values (n_t,) of every column of the table of a motion, by name."""
    from rom.io.history import channels

    return {
        name: (c.unit, c.values.reshape(len(solution.t), -1)[:, k])
        for c in channels(solution)
        for k, name in enumerate(c.names)
    }


def run(
    file: MechanismFile,
    *,
    command: str = "",
    version: str = "",
    progress: bool = False,
    keep: "Keeping | None" = None,
) -> Run:
    """Move the mechanism of a file; command and version are for the record, progress on stderr.

    ``keep`` is a folder that is written while the run lasts, see `made_from`. An unknown column to
    plot is refused before the run.
    """
    from rom.mbs.results.audit import audit

    made = file.mechanism()
    if file.values["output"]["plot"]:
        _check_plot(file, made)
    solution = file.simulate(made, progress=progress, keep=keep)
    return Run(file, solution, audit(solution), command, version)


def made_from(file: MechanismFile) -> dict[str, str]:
    """What the motion of a file depends on, by name: its entries, and the files of its bodies.

    Not its end, which may be another one when an interrupted run goes on.
    """
    found: dict[str, str] = {}
    for section, entries in file.document.data.items():
        if section in ("name", "output", "simulation"):
            continue
        named = entries.items() if isinstance(entries, dict) else [("", entries)]
        found |= {f"{section} {name!r}" if name else section: repr(x) for name, x in named}
    for name, values in file.values["bodies"].items():
        if "file" in values:
            found[f"file of body {name!r}"] = file_digest(values["file"])
    for key, path in python_entries(file.document):
        found[f"Python file of {' '.join(key[:-1])}"] = file_digest(path)
    return found


def file_digest(path: Path) -> str:
    """SHA-256 of the content of a file."""
    from rom.io.files import check_readable

    return hashlib.sha256(check_readable(path).read_bytes()).hexdigest()


def _check_plot(file: MechanismFile, made: "Mechanism") -> None:
    """One short step tells the names of the columns, before the whole run is spent."""
    from rom.mbs.integrate.simulation import simulate

    t = 1e-6 * file.values["simulation"]["t_end"]
    known = columns(simulate(made, t_end=t, dt=t))
    for name in file.values["output"]["plot"]:
        if name not in known:
            place = Place(file.document, ("output", "plot"))
            raise place.error(f"there is no column {name!r} to plot.", nearest(name, known))


def versions() -> dict[str, str]:
    """Of what a result depends on, beside rom itself."""
    import numpy as np
    import scipy

    return {
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "platform": f"{platform.system()} {platform.machine()}, {sys.byteorder} endian",
    }
