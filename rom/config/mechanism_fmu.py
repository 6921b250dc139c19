"""The FMU of a mechanism file: its bodies are reduced now, and travel in the archive."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rom.arguments import typed
from rom.config.document import KeyPath, Values
from rom.config.mechanism import MechanismFile
from rom.config.python_files import python_entries
from rom.errors import ConfigError
from rom.fmu.export import write_fmu
from rom.io.files import check_readable
from rom.io.native import save
from rom.mbs.control.variables import output_names
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.bodies import Part
from rom.names import file_name
from rom.process.child import scratch

SCRIPT_TEXT = '''"""Builds the mechanism of {file}, whose bodies and Python files lie beside it."""

from pathlib import Path

import rom

FOLDER = Path(__file__).parent
CHANGES = {changes!r}


def mechanism():
    return rom.read_mechanism(FOLDER / {file!r}, CHANGES, trust={trust!r}).mechanism()
'''


@typed
def write_mechanism_fmu(
    file: MechanismFile,
    path: str | Path,
    *,
    inputs: Sequence[str] = (),
    outputs: Sequence[str] | None = None,
    dt: float | None = None,
) -> Path:
    """Write the mechanism of a file as an FMU for co-simulation, see `rom.write_fmu`.

    Component files in it are meshed and reduced once, here: the FMU needs neither FEniCSx nor
    geometries. Python files with functions of it travel, too; what they import is looked for where
    the FMU runs.

    Args:
        file: as of `rom.read_mechanism`.
        path: file ending in ``.fmu``.
        inputs: names of loads, motors or drives that follow inputs.
        outputs: "body.marker", names of joints or drives; None for all of them.
        dt: longest time step [s]; None for that of the file.

    Raises:
        ConfigError: as `rom.write_fmu`, or if neither gives a step, or for an event that would end
            the motion.
        FileFormatError: if the file is gone.
        ModelError: if the mechanism cannot be built.
        ResourceError: as `rom.write_fmu`.
        UnsafeFileError: if the file is larger than such a file can be.
    """
    simulation = file.values["simulation"]
    step = simulation.get("dt") if dt is None else dt
    if step is None:
        what = f"{file.document.path} gives no dt, which an FMU needs"
        raise ConfigError(f"{what}; add dt to [simulation], or --dt on the command line.")
    _refuse_ends(file)
    made = file.mechanism()
    with scratch("fmu") as folder:
        text = folder / file.document.path.name
        text.write_bytes(check_readable(file.document.path).read_bytes())
        changes, files = _bodies(file, made, folder)
        programs, copies = _programs(file, folder)
        script = folder / "mechanism.py"
        given = {"changes": changes | programs, "trust": bool(programs)}
        script.write_text(SCRIPT_TEXT.format(file=text.name, **given))
        return write_fmu(
            script,
            path,
            inputs=list(inputs),
            outputs=output_names(made) if outputs is None else list(outputs),
            dt=step,
            rho_inf=simulation.get("rho_inf", 0.9),
            files=[text, *files, *copies],
        )


def _refuse_ends(file: MechanismFile) -> None:
    """An FMU goes on as long as it is asked to; other events change nothing of a motion."""
    for name, values in file.values["events"].items():
        if values["terminal"]:
            raise ConfigError(
                f"event {name!r} ends the motion, which an FMU cannot do.",
                where=file.document.where(("events", name)),
                hint="Write terminal = false, and let whoever moves the FMU end it.",
            )


def _programs(file: MechanismFile, folder: Path) -> tuple[dict[KeyPath, str], list[Path]]:
    """What replaces Python files, and copies of them."""
    copies: dict[Path, Path] = {}
    changes: dict[KeyPath, str] = {}
    for key, path in python_entries(file.document):
        if path not in copies:
            copies[path] = folder / f"functions {len(copies)} {path.name}"
            copies[path].write_bytes(check_readable(path).read_bytes())
        changes[key] = copies[path].name
    return changes, list(copies.values())


def _bodies(
    file: MechanismFile, made: Mechanism, folder: Path
) -> tuple[dict[KeyPath, object], list[Path]]:
    """What replaces the bodies from other files, and the files that it names."""
    changes: dict[KeyPath, object] = {}
    files: list[Path] = []
    for name, values in file.document.data.get("bodies", {}).items():
        if "file" not in values:
            continue
        part = made.parts[name]
        if part.flexible is None:
            changes["bodies", name] = _numbers(part)
            continue
        place = folder / f"{len(files)} {file_name(name)}.rom.npz"
        files.append(save(part.flexible, place))
        changes["bodies", name, "file"] = place.name
    return changes, files


def _numbers(part: Part) -> Values:
    found = {name: getattr(part, name).tolist() for name in ("at", "velocity", "omega", "spin")}
    found |= {"mass": float(part.mass), "orientation": part.p.tolist()}
    found["inertia"] = (np.trace(part.second) * np.eye(3) - part.second).tolist()
    return found | {"markers": {name: np.asarray(x).tolist() for name, x in part.points.items()}}
