"""A run of a mechanism file: the motion, and the folder it is kept in."""

import hashlib
import json
import platform
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import scipy

import rom.mbs
import rom.view
from rom.config.keys import Place, nearest
from rom.config.mechanism import MechanismFile
from rom.config.python_files import python_entries
from rom.io.files import check_readable, write_whole
from rom.io.history import channels, write_history
from rom.model import Report
from rom.view.canvas.films import ENDINGS

RECORD_FILE, SCENE_FILE = "run.json", "scene.json"


@dataclass(frozen=True, slots=True)
class Record:
    """How a run came about: what `rom report` tells of it later."""

    name: str  # of the mechanism
    command: str  # what was typed
    version: str  # of rom
    source: str = ""  # the file that describes it; empty without one

    def write(self, paths: list[Path], solution: "rom.mbs.Solution", audit: Report) -> None:
        """Write it as the last of the files of a run."""
        parts, joints = solution.mechanism.parts.items(), solution.mechanism.joints.items()
        data = {
            "schema": "rom-run",
            "version": [1, 0],
            "name": self.name,
            "command": self.command,
            "versions": {"rom": self.version} | versions(),
            "source": self.source,
            "files": [path.name for path in paths],
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
        write_whole(paths[-1], json.dumps(data, indent=2).encode())


@dataclass(frozen=True, slots=True)
class Run:
    """A motion and what is to be kept of it."""

    file: MechanismFile
    solution: "rom.mbs.Solution"
    audit: Report  # whether it is to be believed
    command: str = ""  # what was typed
    version: str = ""  # of rom

    def write(self, folder: Path) -> None:
        """Write its files, pictures last, so that the motion is there whatever becomes of them."""
        from rom.report.scene import motion_scene, write_scene

        paths = paths_of(self.file, folder)
        self.write_motion(paths)
        how = look_of(self.file) | {"magnify": self.file.values["output"]["magnify"]}
        for path in paths[1:-2]:  # between the table of the motion and its scene
            if path.name == "curves.png":
                self._curves(path)
            elif path.name == "instants.png":
                rom.view.instants(self.solution.mechanism, self.solution, path, **how)
            else:
                write_film(self.solution, path, **how)
        title = f"Motion of {self.file.name}"
        write_scene(motion_scene(self.solution, title=title, **how), paths[-2])

    def write_motion(self, paths: list[Path]) -> None:
        """Write the table of the motion, then the record, the last of the paths."""
        paths[0].parent.mkdir(exist_ok=True)
        write_history(self.solution, paths[0])
        source = self.file.document.path.read_text(encoding="utf-8")
        record = Record(self.file.name, self.command, self.version, source)
        record.write(paths, self.solution, self.audit)

    def _curves(self, path: Path) -> None:
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
        rom.view.history(self.solution.t, groups, path, title=title, caption=caption)


def write_film(
    solution: "rom.mbs.Solution",
    path: Path,
    *,
    magnify: float = 1.0,
    view: npt.ArrayLike | None = None,
    up: npt.ArrayLike | None = None,
) -> None:
    """Write a motion as a film of pictures or, by the ending, as one in space."""
    if path.suffix in ENDINGS:
        rom.view.animate(solution.mechanism, solution, path, magnify=magnify, view=view, up=up)
    else:
        from rom.view.scenes.animation_files import write_animation

        write_animation(solution, path, magnify=magnify, up=up)


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


def happened(solution: "rom.mbs.Solution") -> dict[str, list[float]]:
    """When each event happened [s], by name."""
    return {name: [float(t) for t in found.t] for name, found in solution.events.items()}


def columns(solution: "rom.mbs.Solution") -> dict[str, tuple[str, Any]]:
    """Unit and values (n_t,) of every column of the table of a motion, by name."""
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
    keep: "rom.mbs.Keeping | None" = None,
) -> Run:
    """Move the mechanism of a file; command and version are for the record, progress on stderr.

    ``keep`` is a folder that is written while the run lasts, see `made_from`.
    """
    made = file.mechanism()
    if file.values["output"]["plot"]:
        _check_plot(file, made)
    solution = file.simulate(made, progress=progress, keep=keep)
    return Run(file, solution, rom.mbs.audit(solution), command, version)


def made_from(file: MechanismFile) -> dict[str, str]:
    """What a motion depends on, but for its end, by name: entries, and the files of bodies."""
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
    return hashlib.sha256(check_readable(path).read_bytes()).hexdigest()


def _check_plot(file: MechanismFile, made: "rom.mbs.Mechanism") -> None:
    """One short step tells the names of the columns, before the whole run is spent."""
    t = 1e-6 * file.values["simulation"]["t_end"]
    known = columns(rom.mbs.simulate(made, t_end=t, dt=t))
    for name in file.values["output"]["plot"]:
        if name not in known:
            place = Place(file.document, ("output", "plot"))
            raise place.error(f"there is no column {name!r} to plot.", nearest(name, known))


def versions() -> dict[str, str]:
    """Of what a result depends on, beside rom itself."""
    return {
        "python": platform.python_version(),
        "numpy": np.__version__,
        "scipy": scipy.__version__,
        "platform": f"{platform.system()} {platform.machine()}, {sys.byteorder} endian",
    }
