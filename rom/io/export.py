"""Files for other programs, by name or by the ending of the file name."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from rom.arguments import one_of, typed
from rom.body.flexible import FlexibleBody
from rom.errors import ConfigError, in_file
from rom.io.fields.vtu import write_vtu
from rom.io.fmu.body import write_body_fmu
from rom.io.matrices.dmig import write_dmig
from rom.io.matrices.op4 import write_op4
from rom.io.matrices.user_element import write_user_element
from rom.io.native import load, save
from rom.io.programs.exudyn import read_exudyn, write_exudyn
from rom.io.programs.interface_form import InterfaceForm, interface_form
from rom.io.programs.mbdyn import read_mbdyn, write_mbdyn
from rom.io.programs.openfast import write_openfast
from rom.io.programs.superelements import write_radioss, write_simscape
from rom.io.sid.body import sid_body, standard_input
from rom.io.sid.dialect import read_sid
from rom.io.sid.format import write_sid
from rom.model import Array

SID_SUFFIX = ".sid_fem"
READERS: dict[str, Callable[[str | Path], FlexibleBody]] = {  # ending: reader
    SID_SUFFIX: lambda path: sid_body(read_sid(path)),
    ".fem": read_mbdyn,
    ".py": read_exudyn,
}
HOLDING_FORMATS = ("openfast", "openfast-4")  # formats with one free interface


def _write_sid(body: FlexibleBody, path: str | Path, dialect: str) -> Path:
    return write_sid(standard_input(body), path, dialect=dialect)


def _nastran(form: InterfaceForm) -> dict[str, Array]:
    return {"KAAX": form.K, "MAAX": form.M, "BAAX": form.D}


def _write_dmig(body: FlexibleBody, path: str | Path) -> Path:
    form = interface_form(body)
    return write_dmig(_nastran(form), form.dofs, path, nodes=form.points)


def _write_abaqus(body: FlexibleBody, path: str | Path) -> Path:
    form = interface_form(body)
    matrices = {"STIFFNESS": form.K, "MASS": form.M}
    return write_user_element(matrices, form.dofs, path, nodes=form.points)


OWN_UNITS = ("npz", "sid", "sid-pysid", "sid-geisler")  # say the units of the body; others are SI
NONLINEAR_FORMATS = ("npz", "vtu")  # keep the energy at large deflection, or have no need of any
FORMATS: dict[str, tuple[str, Callable[..., Path]]] = {  # name: (ending that chooses it, writer)
    "npz": (".npz", save),
    "vtu": (".vtu", write_vtu),
    "sid": (SID_SUFFIX, partial(_write_sid, dialect="fembs")),
    "dmig": (".dmig", _write_dmig),
    "op4": (".op4", lambda body, path: write_op4(_nastran(interface_form(body)), path)),
    "abaqus": (".inp", _write_abaqus),
    "exudyn": (".py", write_exudyn),
    "mbdyn": (".fem", write_mbdyn),
    "simscape": (".mat", write_simscape),
    "fmu": (".fmu", write_body_fmu),
    "radioss": (".pch", write_radioss),
    "openfast": ("", write_openfast),
    "openfast-4": ("", partial(write_openfast, version=4)),
    "sid-pysid": ("", partial(_write_sid, dialect="pysid")),
    "sid-geisler": ("", partial(_write_sid, dialect="geisler")),
}


@typed
def export(
    body: FlexibleBody, path: str | Path, *, to: str | None = None, held: Sequence[str] = ()
) -> Path:
    """Write a body in the format of another program, in SI where the format names no units.

    Args:
        body: the body.
        path: file to write.
        to: "vtu" for ParaView, "npz" for the native body file, "sid" for Standard Input Data of
            Simpack, "sid-pysid" and "sid-geisler" for its dialects, "dmig" and "op4" for Nastran
            (KAAX, MAAX, BAAX, see `rom.io.programs.interface_form`), "abaqus" for a linear user
            element with stiffness and mass but no damping, "exudyn" for a Python module that adds
            the body to an Exudyn system, "mbdyn" for its modal joint, "simscape" for its Reduced
            Order Flexible Solid, "radioss" for a flexible body of OpenRadioss, "openfast" for a
            superelement of OpenFAST's module ExtPtfm with the weight of the body, "openfast-4" for
            those up to version 4, "fmu" for a Functional Mock-up Unit of its small motions, see
            `rom.write_body_fmu`; None for the ending of the path: ``.vtu``, ``.npz``, ``.SID_FEM``,
            ``.dmig``, ``.op4``, ``.inp``, ``.py``, ``.fem``, ``.mat``, ``.pch``, ``.fmu``.
        held: interfaces that stand still; for "openfast", which takes one free interface.

    Raises:
        ConfigError: if the format or the ending is not known, another one is given interfaces to
            hold, or the place is not writable.

    Example:
        >>> body = rom.load("beam.rom.npz")
        >>> file = rom.export(body, "beam.SID_FEM")
        >>> rom.read_sid("beam.SID_FEM").n_modes == body.n_modes
        True
    """
    kind = format_of(path, to)
    if held and kind not in HOLDING_FORMATS:
        raise ConfigError(f"{kind} holds no interfaces, {HOLDING_FORMATS[0]} does; leave held out.")
    if body.quartic is not None and kind not in NONLINEAR_FORMATS:
        text = f"the format {kind!r} has no place for the energy of body {body.name!r} at large"
        hint = "Write the native file, or reduce without nonlinear."
        raise ConfigError(f"{text} deflection.", hint=hint)
    if body.certificate is not None:
        body.certificate.warn_of_failures(f"the certificate of body {body.name!r}")
    options = {"held": tuple(held)} if held else {}
    body = body if kind in OWN_UNITS else body.in_units("SI")
    return FORMATS[kind][1](body, path, **options)


def format_of(path: str | Path, to: str | None = None) -> str:
    """The name of the format that a file will have."""
    if to is not None:
        return one_of("format", to, FORMATS)
    ending = Path(path).suffix.lower()
    endings = {known: name for name, (known, _) in FORMATS.items() if known}
    if ending not in endings:
        text = f"{path} has the ending {ending!r}; known: {', '.join(sorted(endings))}"
        raise ConfigError(f"{text}; or name a format: {', '.join(FORMATS)}.")
    return endings[ending]


def read_body(path: str | Path) -> FlexibleBody:
    """A body from the native file, or that of another program, by the ending of the path.

    Args:
        path: ``.npz``, ``.SID_FEM`` for Standard Input Data without geometric stiffness, ``.fem``
            for the modal joint of MBDyn, ``.py`` for a module for Exudyn that rom has written.

    Raises:
        ConfigError: if Standard Input Data contain geometric stiffness.
        FileFormatError: if the file is missing, cut, or not what its ending promises.
        QualityGateError: if its numbers are not those of a body.
    """
    with in_file(path):
        return READERS.get(Path(path).suffix.lower(), load)(path)
