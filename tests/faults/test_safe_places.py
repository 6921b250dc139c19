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
from cases.refusals import refuses
from cases.solid import block, reduced
from rom.cli.main import main
from rom.io import files
from rom.names import csv_cell
from rom.process import child

pytestmark = pytest.mark.once
FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    made = reduced(4, block(), reference="root")
    rom.save(made, "bar.rom.npz")
    return tmp_path


def test_what_lacks_room_or_a_place_for_a_scratch_folder_says_so(monkeypatch):
    for number in (errno.ENOSPC, errno.EFBIG, errno.EDQUOT):
        with pytest.raises(rom.ResourceError, match="TMPDIR"), child.scratch("full"):
            raise OSError(number, "")
    with monkeypatch.context() as patch:
        patch.setattr(tempfile, "mkdtemp", lambda **_: (_ for _ in ()).throw(FULL))
        with pytest.raises(rom.ResourceError, match="TMPDIR") as caught, child.scratch("full"):
            pass
        assert tempfile.gettempdir() in str(caught.value)
    for room, kind in ((2**40, rom.ConfigError), (0, rom.ResourceError)):
        monkeypatch.setattr(child.shutil, "disk_usage", lambda _, n=room: SimpleNamespace(free=n))
        with pytest.raises(kind), child.scratch("full"):
            raise rom.ConfigError("the process that draws ended with code 1.")
    monkeypatch.setattr(tempfile, "tempdir", None)
    lost = FileNotFoundError(errno.ENOENT, "No usable temporary directory found in ['/tmp']")
    monkeypatch.setattr(tempfile, "_get_default_tempdir", lambda *_: (_ for _ in ()).throw(lost))
    with pytest.raises(rom.ResourceError, match="TMPDIR"), child.scratch("none"):
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

    monkeypatch.setattr(rom.Keeping, "due", lambda *_: True)
    monkeypatch.setattr(files.os, "fsync", no_room)
    full.append(True)
    assert main([*SWING, "out"]) == 6
    said = capsys.readouterr().err
    assert "motion.parts" in said and "--resume" in said and "othing was left" not in said
    full.clear()
    assert main([*SWING, "out", "--resume"]) == 0
    assert list(Path("out").glob("*.csv")) and not list(Path("out", "motion.parts").glob("*.npz"))


def test_the_output_of_a_file_stays_in_its_folder(tmp_path):
    folder = tmp_path / "here"
    (folder / "a").mkdir(parents=True)
    (folder / "link").symlink_to(tmp_path)
    file = folder / "part.toml"
    for name in ("x.rom.npz", "a/x.rom.npz", "a/../x.rom.npz"):
        file.write_text(f'[output]\nfile = "{name}"\n')
        assert rom.read_component(file).output == folder / name
    for name in ("../x.rom.npz", "/x.rom.npz", "a/../../x.rom.npz", "link/x.rom.npz"):
        file.write_text(f'[output]\nfile = "{name}"\n')
        refuses(rom.ConfigError, "output.file.*leads out of the folder", rom.read_component, file)


def test_texts_in_tables_of_motions_too_are_no_formulas_and_one_cell(tmp_path):
    for text in (*"=1+1 +cmd -2 @x plain a=b a,b =a,b".split(), "\tx", "\rx", 'a "b"', ""):
        (row,) = csv.reader(io.StringIO(f"{csv_cell(text)},2\n", newline=""))
        assert row == ["'" * (text[:1] in [*"=+-@\t\r"]) + text, "2"]
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
    for mode, safe in {0o644: True, 0o600: True, 0o646: False, 0o777: False}.items():
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
    with pytest.warns(rom.RomWarning, match="others may write there"):
        assert jit.usable_cache() != tmp_path
