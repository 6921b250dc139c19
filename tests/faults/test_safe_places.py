"""Places of files: full ones are named, those of others give no code; outputs and tables."""

import csv
import errno
import io
import os
import stat
import tempfile
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

import rom
from cases.command import environment, python
from cases.solid import block, reduced
from rom.cli.main import main
from rom.config.component import read_component
from rom.errors import ConfigError, ResourceError, RomWarning
from rom.io import files
from rom.mbs.integrate.keeping import Keeping
from rom.names import csv_cell
from rom.process import child

pytestmark = pytest.mark.once
FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.fixture
def here(tmp_path, monkeypatch):
    """A folder with a body file in it."""
    monkeypatch.chdir(tmp_path)
    made = reduced(4, block(), reference="root")
    rom.save(made, "bar.rom.npz")
    return tmp_path


def test_a_full_temporary_folder_is_named_with_its_variable(here, monkeypatch, capsys):
    pytest.importorskip("pyvista", reason="pictures need it")
    monkeypatch.setattr(tempfile, "mkdtemp", lambda **_: (_ for _ in ()).throw(FULL))
    assert main(["view", "bar.rom.npz", "-o", "bar.png"]) == 6
    said = capsys.readouterr().err
    assert "TMPDIR" in said and tempfile.gettempdir() in said and "traceback" not in said.lower()


@pytest.mark.parametrize("error", [FULL, OSError(errno.EFBIG, ""), OSError(errno.EDQUOT, "")])
def test_what_lacks_room_inside_a_scratch_folder_says_so(error):
    with pytest.raises(ResourceError, match=r"no room for files.*TMPDIR"), child.scratch("full"):
        raise error


def test_a_child_that_failed_in_a_full_folder_is_told_the_same(monkeypatch):
    """Whatever error its end became here; with room it stays what it was."""
    for room, kind in ((2**40, ConfigError), (0, ResourceError)):
        monkeypatch.setattr(child.shutil, "disk_usage", lambda _, n=room: SimpleNamespace(free=n))
        with pytest.raises(kind), child.scratch("full"):
            raise ConfigError("the process that draws ended with code 1.")


def test_where_no_folder_takes_a_file_there_is_none(monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", None)
    lost = FileNotFoundError(errno.ENOENT, "No usable temporary directory found in ['/tmp']")
    monkeypatch.setattr(tempfile, "_get_default_tempdir", lambda *_: (_ for _ in ()).throw(lost))
    with pytest.raises(ResourceError, match="TMPDIR"), child.scratch("none"):
        pass


SWING = ["simulate", "bar.rom.npz", "--hinge", "root", "--t-end", "1e-3", "--dt", "1e-4", "-o"]


def test_a_disk_that_is_full_at_the_end_leaves_the_motion_and_says_how_to_go_on(
    here, monkeypatch, capsys
):
    sync, full = os.fsync, []

    def no_room(handle):
        place = Path(os.readlink(f"/proc/self/fd/{handle}"))
        if full and place.is_file() and ".npz." not in place.name:
            raise FULL
        sync(handle)

    monkeypatch.setattr(Keeping, "due", lambda *_: True)
    monkeypatch.setattr(files.os, "fsync", no_room)
    full.append(True)
    assert main([*SWING, "out"]) == 6
    said = capsys.readouterr().err
    assert "motion.parts" in said and "--resume" in said and "othing was left" not in said
    full.clear()
    assert main([*SWING, "out", "--resume"]) == 0
    assert list(Path("out").glob("*.csv")) and not list(Path("out", "motion.parts").glob("*.npz"))


def test_what_takes_long_after_ctrl_c_is_said(here, monkeypatch, capsys):
    def stopped(self):
        raise KeyboardInterrupt

    from rom.mbs.integrate.run import Record

    monkeypatch.setattr(Record, "pause", stopped)
    assert main([*SWING, "out"]) == 7
    assert "Ctrl-C leaves that out" in capsys.readouterr().err


OUT = [("../x.rom.npz", False), ("/x.rom.npz", False), ("a/../../x.rom.npz", False),
       ("link/x.rom.npz", False), ("x.rom.npz", True), ("a/x.rom.npz", True),
       ("a/../x.rom.npz", True)]  # fmt: skip


@pytest.mark.parametrize(("name", "inside"), OUT)
def test_the_output_of_a_file_stays_in_its_folder(name, inside, tmp_path):
    folder = tmp_path / "here"
    (folder / "a").mkdir(parents=True)
    (folder / "link").symlink_to(tmp_path)
    file = folder / "part.toml"
    file.write_text(f'[output]\nfile = "{name}"\n')
    if inside:
        assert read_component(file).output == folder / name
        return
    with pytest.raises(ConfigError, match=r"output.file.*leads out of the folder"):
        read_component(file)


CELLS = {"=1+1": "'=1+1", "+cmd": "'+cmd", "-2": "'-2", "@x": "'@x", "\tx": "'\tx",
         "\rx": "\"'\rx\"", "plain": "plain", "a=b": "a=b", "a,b": '"a,b"',
         'a "b"': '"a ""b"""', "=a,b": "\"'=a,b\"", "": ""}  # fmt: skip


@pytest.mark.parametrize("text", CELLS)
def test_a_text_in_a_table_is_no_formula_and_one_cell(text):
    assert csv_cell(text) == CELLS[text]
    (row,) = csv.reader(io.StringIO(f"{csv_cell(text)},2\n", newline=""))
    assert row[0].removeprefix("'" if text[:1] in "=+-@\t\r" else "") == text


def test_tables_of_motions_have_no_formulas_in_their_heads(tmp_path):
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    for k, name in enumerate(('=HYPERLINK("x")', "+a", "@b")):
        mech.add_rigid(name, mass=1.0, inertia=(1e-2,) * 3, at=(k, 0, 0))
    rom.io.write_history(rom.simulate(mech, t_end=2e-3, dt=1e-3), tmp_path / "a.csv")
    with open(tmp_path / "a.csv", newline="") as file:
        head, *rows = csv.reader(file)
    assert any("HYPERLINK" in cell for cell in head)
    assert not [cell for cell in head if cell.startswith(("=", "+", "-", "@"))]
    assert np.array(rows, dtype=float).shape == (3, len(head))  # numbers stay numbers


def test_code_is_trusted_of_oneself_the_administrator_and_who_owns_the_package(tmp_path):
    file = tmp_path / "code"
    assert child.trusted(file)  # which is not there
    file.touch()
    modes = {0o644: True, 0o600: True, 0o646: False, 0o777: False}
    for mode, safe in modes.items():
        file.chmod(mode)
        assert child.trusted(file) is safe, oct(mode)
    if os.geteuid() == 0:
        file.chmod(0o644)
        os.chown(file, 12345, -1)
        assert not child.trusted(file)
        os.chown(file, 0, 12345)
        file.chmod(0o664)
        assert not child.trusted(file)


KEPT = """
import numba
from rom.mbs.compiler.cache import COMPILED_FUNCTIONS, kept

@kept(numba.njit(cache=True))
def twice(x):
    return 2 * x

twice(1.0)
print(len(COMPILED_FUNCTIONS))
"""


def test_compiled_code_that_others_may_have_written_is_not_loaded(tmp_path):
    """Of the folder, and of one file in it."""
    script, code = tmp_path / "twice.py", tmp_path / "code"
    script.write_text(KEPT)
    code.mkdir()

    def compiled():
        env = environment(NUMBA_CACHE_DIR=str(code))
        done = python(script, env=env, timeout=120, check=True)
        return int(done.stdout)

    assert (compiled(), compiled()) == (1, 0)
    kept = [path for path in code.rglob("*") if path.is_file() and path.suffix != ".lock"]
    (index,) = (path for path in kept if path.suffix == ".nbi")
    index.chmod(0o666)
    assert compiled() == 1
    index.chmod(0o644)
    index.parent.chmod(0o777)
    assert compiled() == 1
    index.parent.chmod(stat.S_IRWXU)


@pytest.mark.fenicsx
def test_forms_are_not_taken_from_where_others_may_write(tmp_path, monkeypatch):
    from rom.fe import jit

    monkeypatch.setattr(jit, "cache_directory", lambda: tmp_path)
    assert jit.usable_cache() == tmp_path
    tmp_path.chmod(0o777)
    with pytest.warns(RomWarning, match="others may write there"):
        assert jit.usable_cache() != tmp_path
