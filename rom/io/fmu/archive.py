"""Compile the library of an FMU and pack the archive."""

import hashlib
import platform
import re
import shutil
import uuid
import zipfile
from pathlib import Path
from typing import IO

from rom.errors import ResourceError
from rom.io.files import write_whole
from rom.io.fmu.description import Content, model_description
from rom.names import ORIGIN_MARK, check_text
from rom.process.child import Limits, run, scratch

SOURCES = Path(__file__).with_name("c")
OPTIONS = ("-std=c11", "-O2", "-fPIC", "-shared", "-fvisibility=hidden")
COMPILE_TIME_LIMIT = 600.0  # [s]
ZIP_EPOCH = (1980, 1, 1, 0, 0, 0)  # the same archive from the same content


def write_archive(path: Path, content: Content) -> Path:
    """Compile and pack, whole or not at all."""
    check_text(content.name, "a model")
    identifier = re.sub(r"\W", "_", content.name, flags=re.ASCII)
    identifier = identifier if identifier[:1].isalpha() else f"m{identifier}"
    names = ("fmi2.c", content.core)
    files = (*names, "model.h", *content.headers)
    sources = {name: (SOURCES / name).read_bytes() for name in files}
    guid = _guid(sources, content)
    sources["config.h"] = f'#define GUID "{guid}"\n'.encode()
    if content.data:
        sources["tables.h"] = content.data.encode()
    packed = {f"sources/{name}": data for name, data in sources.items()}
    packed |= {f"resources/{name}": data for name, data in content.resources.items()}
    bits = "64" if platform.architecture()[0] == "64bit" else "32"
    place = f"binaries/{platform.system().lower()}{bits}/{identifier}.so"
    packed[place] = _library(sources, names)
    packed["modelDescription.xml"] = model_description(content, guid, identifier, names)

    def pack(file: IO[bytes]) -> None:
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.comment = ORIGIN_MARK.encode()
            for name, data in sorted(packed.items()):
                archive.writestr(zipfile.ZipInfo(name, ZIP_EPOCH), data, zipfile.ZIP_DEFLATED)

    return write_whole(path, pack)


def _guid(sources: dict[str, bytes], content: Content) -> str:
    """The same for the same content, another one for any other."""
    digest = hashlib.sha256()
    parts = {**sources, **content.resources, "tables": content.data.encode()}
    for name, data in sorted(parts.items()):
        digest.update(f"{name} {len(data)}\n".encode() + data)
    digest.update(model_description(content))
    return f"{{{uuid.UUID(bytes=digest.digest()[:16])}}}"


def _library(sources: dict[str, bytes], names: tuple[str, ...]) -> bytes:
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None:
        text = "an FMU needs a C compiler, and neither gcc nor cc is here."
        raise ResourceError(text, hint="On Debian: apt-get install gcc libc6-dev.")
    with scratch("compile") as folder:
        for name, data in sources.items():
            (folder / name).write_bytes(data)
        command = [compiler, *OPTIONS, *names, "-lm", "-o", "out.so"]
        limits = Limits(seconds=COMPILE_TIME_LIMIT)
        # what the compiler puts aside goes when the folder goes
        done = run(command, folder=folder, limits=limits, variables={"TMPDIR": str(folder)})
        if done.code or done.overtime:
            why = f"no end within {COMPILE_TIME_LIMIT:g} s" if done.overtime else done.err.strip()
            raise ResourceError(f"{compiler} cannot compile the FMU: {why}.")
        return (folder / "out.so").read_bytes()
