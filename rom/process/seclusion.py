"""What libraries would read in the folder one stands in is not read, by a verb or any child.

Matplotlib takes a ``matplotlibrc`` from there before that of its user, which can start LaTeX;
Numba takes a ``.numba_config.yaml``, petsc4py a ``petsc.cfg``, when they are imported, which is
done elsewhere. A variable with a relative path stands for the same folder and does not count, nor
does such a place of modules. PETSc, dolfinx and FFCx look later, and are told not to in `rom.fe`.
"""

# Of what Python has not loaded itself nothing is imported here, for the reason in `rom`.
import os
import sys

# that read a file of the working folder when they are imported
READERS = ("matplotlib", "numba", "petsc4py", "petsc4py.PETSc", "slepc4py", "slepc4py.SLEPc")
SAFE_FOLDER = os.sep
PLACES = (  # variables that name a folder or file with settings, code or fonts
    *("MPLCONFIGDIR", "MATPLOTLIBRC", "NUMBA_CACHE_DIR", "PYVISTA_USERDATA_PATH"),
    *("XDG_CONFIG_HOME", "XDG_CACHE_HOME", "XDG_DATA_HOME", "OMPI_MCA_mca_base_param_files"),
)
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from importlib.machinery import ModuleSpec
    from types import ModuleType


class ImportedElsewhere:
    """Finds these libraries as Python does, and lets their code run in another folder."""

    def find_spec(
        self, name: str, path: "Sequence[str] | None" = None, target: "ModuleType | None" = None
    ) -> "ModuleSpec | None":
        """Of one of them."""
        if name not in READERS:
            return None
        others = (f for f in sys.meta_path if not isinstance(f, ImportedElsewhere))
        spec = next(filter(None, (f.find_spec(name, path, target) for f in others)), None)
        if spec is not None and spec.loader is not None:
            usual = spec.loader.exec_module
            spec.loader.exec_module = lambda module: elsewhere(usual, module)  # type: ignore[method-assign]
        return spec


def elsewhere(work: "Callable[..., object]", *arguments: object) -> None:
    """Do this in a folder where nobody but the administrator leaves files."""
    here = os.open(os.curdir, os.O_RDONLY)
    try:
        os.chdir(SAFE_FOLDER)
        work(*arguments)
    finally:
        os.fchdir(here)
        os.close(here)


def leave_working_folder_alone() -> None:
    """For the rest of this process."""
    for name in PLACES:
        if os.environ.get(name) and not os.path.isabs(os.environ[name]):
            del os.environ[name]
    sys.path[:] = [place for place in sys.path if os.path.isabs(place) or not os.path.exists(place)]
    sys.meta_path.insert(0, ImportedElsewhere())
