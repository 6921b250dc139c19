"""Write the FMU of a mechanism."""

import json
import sys
from pathlib import Path
from typing import Annotated

from rom.arguments import Positive, Share, typed
from rom.errors import ConfigError, warn
from rom.fmu.driven import SETTINGS_FILE
from rom.io.files import check_writable
from rom.io.fmu.archive import write_archive
from rom.io.fmu.description import Content, Variable
from rom.names import check_ending
from rom.process.child import Limits, python, run, scratch

PYTHON_FILE = "python"  # names the interpreter; read by process.c
MODEL_FOLDER = "model"  # of the Python file, below the resources
BUILD_TIME_LIMIT = 600  # [s] for the mechanism, its compilation included


@typed
def write_fmu(
    script: str | Path,
    path: str | Path,
    *,
    inputs: tuple[str, ...] | list[str] = (),
    outputs: tuple[str, ...] | list[str] = (),
    dt: Annotated[float, Positive("s")],
    rho_inf: Share = 0.9,
    files: tuple[str | Path, ...] | list[str | Path] = (),
) -> Path:
    """Write a mechanism as an FMU for co-simulation (FMI 2.0), see `rom.fmu`.

    The mechanism is built by a Python file, for its functions of time cannot be written down
    otherwise: a function ``mechanism()`` returns a `rom.Mechanism`. What it reads it must find in
    its own folder, as in ``rom.load(Path(__file__).with_name("rod.rom.npz"))``; it is tried in an
    empty folder before it is packed. The FMU runs where rom is installed, on POSIX systems, by the
    Python that wrote it; elsewhere by the one that the variable ROM_PYTHON names, or python3.

    Inputs replace functions of time and are held over a communication step: three components of a
    force or torque [N, N m]; the amplitude of a spread load; the force or torque of a motor; for a
    drive ``name.acceleration`` [rad/s^2 or m/s^2], from which its rate and coordinate follow
    without jumps. Outputs are: of ``"body.marker"`` position, velocity, quaternion (marker to
    world, scalar first) and angular velocity, all in the world; of a joint its angle, counted over
    whole turns, or its way, with their rates; of a drive the load it supplies. Parameters are
    ``dt`` and ``rho_inf``.

    Args:
        script: Python file with the function ``mechanism``.
        path: file ending in ``.fmu``.
        inputs: names of loads, spread loads, motors or drives.
        outputs: "body.marker", names of joints or drives.
        dt: longest time step [s]; a communication step is divided into equal ones.
        rho_inf: spectral radius of generalised-alpha at infinite frequency [1].
        files: what the Python file reads or imports; put beside it.

    Raises:
        ConfigError: for an unknown input or output, a file that is missing, a mechanism that
            cannot be built from these files alone, or a place not writable.
        ResourceError: if there is no C compiler, it fails, or the disk is full.
    """
    path, script = check_ending(check_writable(path), "a unit", ".fmu"), Path(script)
    resources = {f"{MODEL_FOLDER}/{p.name}": _read(p) for p in (script, *map(Path, files))}
    settings: dict[str, object] = {"script": f"{MODEL_FOLDER}/{script.name}"}
    settings |= {"inputs": list(inputs), "outputs": list(outputs)}
    settings |= {"dt": float(dt), "rho_inf": float(rho_inf)}
    resources[PYTHON_FILE] = sys.executable.encode()
    resources[SETTINGS_FILE] = json.dumps(settings, indent=1).encode()
    about = f"Mechanism {path.stem}, moved by rom, which must be installed where the FMU runs."
    variables = _variables(resources, script)
    content = Content(
        path.stem, about, variables, float(dt), "process.c", resources=resources, tool=True
    )
    return write_archive(path, content)


def _read(path: Path) -> bytes:
    if not path.is_file():
        raise ConfigError(f"there is no file {path}.", hint="Relative paths start where you are.")
    return path.read_bytes()


def _variables(resources: dict[str, bytes], script: Path) -> list[Variable]:
    """The variables as the FMU itself will find them, in a process and folder of its own."""
    with scratch("fmu") as folder:
        place, empty, out = (folder / name for name in ("resources", "empty", "out"))
        for name, data in resources.items():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            (place / name).write_bytes(data)
        empty.mkdir()
        command = python("rom.fmu", str(place), str(out))
        done = run(command, folder=empty, limits=Limits(seconds=BUILD_TIME_LIMIT))
        if not out.exists():
            last = f"no end within {BUILD_TIME_LIMIT} s" if done.overtime else done.last
            raise ConfigError(
                f"{script.name} fails in a folder that holds only it and the files named: "
                f"{last.replace(str(folder), '')}",
                hint="Name all files it needs, and let it look for them beside itself.",
            )
        found = json.loads(out.read_text())
    for sentence in found["warnings"]:
        warn(sentence)
    if "error" in found:
        raise ConfigError(found["error"], where=script.name, hint=found["hint"])
    return [Variable(**one) for one in found["variables"]]
