"""The cache of compiled forms survives killed runs, read-only folders and planted options."""

import os
import sys
import time
from types import SimpleNamespace

import pytest

import rom.fe
from cases.boxes import box
from rom.errors import ConfigError, ResourceError, RomWarning

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = pytest.mark.fenicsx

from mpi4py import MPI  # noqa: E402

import ufl  # noqa: E402

from rom.fe import jit  # noqa: E402
from rom.fe.compat import assemble_matrix, lagrange  # noqa: E402

NAME = "libffcx_forms_0123456789abcdef0123456789abcdef01234567"


def test_what_a_killed_compilation_left_is_removed(tmp_path):
    finished, killed = tmp_path / f"{NAME}a.c", tmp_path / f"{NAME}b.c"
    for source in (finished, killed):
        source.write_text("int x;")
    finished.with_suffix(".c.cached").write_text("")
    long_ago = time.time() - 3600
    os.utime(killed, (long_ago, long_ago))
    assert jit.clear_stale_cache(tmp_path) == [killed]
    assert finished.exists() and not killed.exists()
    killed.write_text("int x;")  # now a compilation under way, which is waited for
    start = time.perf_counter()
    assert jit.clear_stale_cache(tmp_path, age=0.5) == [killed]
    assert time.perf_counter() - start > 0.3


def test_a_form_whose_compilation_was_killed_is_compiled_again(tmp_path, monkeypatch):
    """Without the clearing, dolfinx waits for the library and gives up."""
    monkeypatch.setattr(jit, "cache_directory", lambda: tmp_path)
    mesh, _ = box(cells=(1, 1, 1))
    with jit.compiling(MPI.COMM_SELF):
        V = lagrange(mesh, 1)
        u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
        first = assemble_matrix(u[2] * v[2] * ufl.dx).norm()
    sources = list(tmp_path.glob("libffcx_forms_*.c"))
    assert sources
    for source in sources:
        source.with_suffix(".c.cached").unlink()
        os.utime(source, (1e9, 1e9))
    with jit.compiling(MPI.COMM_SELF):
        assert assemble_matrix(u[2] * v[2] * ufl.dx).norm() == first
    assert not any(source.exists() and source.stat().st_mtime == 1e9 for source in sources)


def test_a_cache_that_cannot_be_written_is_replaced(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(jit, "cache_directory", lambda: tmp_path / "file" / "fenics")
    with pytest.warns(RomWarning, match="cannot be written"):
        assert jit.usable_cache().is_dir()


def test_a_missing_library_is_named_with_its_package(monkeypatch):
    for name in ("elasticity", "forms.region"):
        monkeypatch.delitem(sys.modules, f"rom.fe.{name}", raising=False)
    monkeypatch.setitem(sys.modules, "ufl", None)
    with pytest.raises(ConfigError, match=r"import of ufl halted.*apt-get install python3-dolfinx"):
        rom.fe.model("rod.geo", material=None)
    monkeypatch.undo()


@pytest.mark.parametrize(("there", "named"), [("", "Python.h"), ("Python.h", "")])
def test_what_compiles_forms_is_named_where_it_is_missing(tmp_path, monkeypatch, there, named):
    """Packages of pip need the headers of Python and a compiler, and bring neither."""
    (tmp_path / there).touch()
    places = SimpleNamespace(get_path=lambda kind: str(tmp_path), get_config_var=lambda name: "sh")
    monkeypatch.setattr(jit, "sysconfig", places)
    kind = ResourceError if named else OSError
    with pytest.raises(kind, match=f"{named} is not here.*python3-dev" if named else "broken"):
        with jit.compiling(MPI.COMM_SELF):
            raise OSError("the build is broken")
