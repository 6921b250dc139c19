"""The whole examination, in the order of the report."""

from rom.doctor.caches import caches
from rom.doctor.finding import Finding
from rom.doctor.libraries import fenicsx
from rom.doctor.machine import blas, light, machine
from rom.doctor.pictures import pictures
from rom.doctor.probes import start


def diagnose(*, fix: bool = False) -> list[Finding]:
    """Look at everything; works without FEniCSx and without a display.

    Whatever could crash is looked at in a process of its own.

    Args:
        fix: remove what killed runs have left in the caches.
    """
    fe = start("rom.fe.probe", *(["--fix"] if fix else []))
    drawing = start("rom.doctor.drawing")
    found = light()
    libraries = fe.answer()
    return [
        *found,
        *fenicsx(libraries, fe.ending),
        *blas(libraries.get("mapped", {}).get("value", [])),
        *pictures(drawing.answer(), drawing.ending),
        *caches(libraries.get("forms", {}), fix=fix),
        *machine(),
    ]
