"""Films: their files, what makes them, and how far they are."""

import io
import logging
import shutil
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest

pytest.importorskip("matplotlib", reason="pictures need matplotlib")

import rom
from cases.solid import block
from rom.checks import certificate
from rom.io.ours import is_ours
from rom.process import progress
from rom.reduction import full_model
from rom.stages import bodies
from rom.view.canvas.films import Film, even, film_path

PAGES = np.arange(3 * 5 * 7 * 3, dtype=np.uint8).reshape(3, 5, 7, 3)
FAKE = """#!{python} -S
import sys
frames = sys.stdin.buffer.read()
open(sys.argv[-1], "wb").write(b"0000ftyp" + " ".join(sys.argv[1:]).encode() + frames)
"""


def program(folder, text):
    path = folder / "ffmpeg"
    path.write_text(text)
    path.chmod(0o755)
    return path


@pytest.fixture
def fake(tmp_path, monkeypatch):
    """An ffmpeg that writes down what it was asked and given."""
    folder = tmp_path / "bin"
    folder.mkdir()
    program(folder, FAKE.format(python=sys.executable))
    monkeypatch.setenv("PATH", str(folder))
    return folder


def test_ffmpeg_is_given_all_frames_of_even_size_and_their_pace(fake, tmp_path):
    path = Film(PAGES, 0.04).save(tmp_path / "a.mp4")
    data = path.read_bytes()
    pages = even(PAGES)
    assert data.endswith(pages.tobytes())
    words = data[8 : -pages.size].decode().split(" ")
    said = dict(pairwise(words))
    assert (said["-f"], said["-pix_fmt"]) == ("rawvideo", "yuv420p")
    assert (said["-s"], said["-c:v"], float(said["-framerate"])) == ("8x6", "libx264", 25.0)
    assert is_ours(path, "mp4") and not is_ours(fake / "ffmpeg", "mp4")
    assert pages.shape == (3, 6, 8, 3)
    np.testing.assert_array_equal(pages[:, :5, :7], PAGES)
    np.testing.assert_array_equal(pages[:, 5, :7], PAGES[:, 4])
    np.testing.assert_array_equal(pages[:, :5, 7], PAGES[:, :, 6])
    assert even(pages).shape == pages.shape


def test_an_ffmpeg_that_fails_or_is_missing_is_named_with_its_cure(fake, tmp_path, monkeypatch):
    program(fake, f"#!{sys.executable} -S\nimport sys\nsys.exit('Unknown encoder')\n")
    with pytest.raises(rom.ResourceError, match="ended with code 1: Unknown encoder"):
        Film(PAGES, 0.04).save(tmp_path / "a.mp4")
    assert not (tmp_path / "a.mp4").exists()
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(rom.ResourceError, match="ffmpeg, which is not on the PATH") as caught:
        film_path(tmp_path / "a.mp4")
    assert "apt install ffmpeg" in caught.value.hint and ".gif" in caught.value.hint
    assert film_path(tmp_path / "a.gif") == tmp_path / "a.gif"
    with pytest.raises(rom.ConfigError, match=r"'\.avi' is unknown") as caught:
        film_path(tmp_path / "a.avi")
    assert ".gif or .mp4" in caught.value.hint


@pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="ffmpeg is not installed")
def test_a_film_of_ffmpeg_plays_with_its_pictures(tmp_path):
    colours = np.array([[200, 30, 30], [30, 160, 30], [30, 30, 200]], dtype=np.uint8)
    pages = np.broadcast_to(colours[:, None, None], (3, 33, 47, 3))
    path = Film(pages, 0.1).save(tmp_path / "a.mp4")
    assert is_ours(path, "mp4")
    command = ["ffmpeg", "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    frames = subprocess.run(command, capture_output=True, check=True).stdout
    seen = np.frombuffer(frames, np.uint8).reshape(3, 34, 48, 3).astype(int)
    assert np.abs(seen.mean(axis=(1, 2)) - colours).max() < 12


class Terminal(io.StringIO):
    """Somebody who looks."""

    def isatty(self):
        return True


def followed(monkeypatch, stream):
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setattr(progress, "LOOK_INTERVAL", 1e-3)
    asked = []
    with progress.followed(10, "drawing", lambda: asked.append(1) or min(len(asked), 10)):
        while stream.isatty() and len(asked) < 3:
            pass
    return stream.getvalue()


def test_progress_and_stages_are_shown_on_a_terminal_and_cleared(monkeypatch):
    monkeypatch.setattr(progress, "find_spec", lambda name: None)
    text = followed(monkeypatch, Terminal())
    assert "\rdrawing   20 %" in text and text.endswith("\r")
    assert text.rsplit("\r", 2)[-2].strip() == ""
    text = staged(monkeypatch, Terminal())
    shown = [part.strip() for part in text.split("\r")[1:]]
    assert shown == ["factor    0 %", "solve   50 %", "", ""]
    assert staged(monkeypatch, Terminal(), long=False) == ""
    for silent in (staged, followed):
        assert silent(monkeypatch, io.StringIO()) == ""
    monkeypatch.setattr(progress, "ranks", lambda: (1, 2))
    assert staged(monkeypatch, Terminal()) == ""


def test_progress_is_shown_by_tqdm_where_it_is_installed(monkeypatch):
    pytest.importorskip("tqdm", reason="tqdm is not installed")
    assert "drawing" in followed(monkeypatch, Terminal())


def staged(monkeypatch, stream, **options):
    monkeypatch.setattr(sys, "stderr", stream)
    with progress.stages(2, **options) as begin:
        begin("factor")
        begin("solve")
    return stream.getvalue()


def test_reductions_and_modes_of_large_models_say_how_far_they_are(monkeypatch):
    for module in (bodies, full_model, certificate):
        monkeypatch.setattr(module, "MANY_DOFS", 100)
    monkeypatch.setattr(progress, "find_spec", lambda name: None)

    def seen(level):
        stream = Terminal()
        monkeypatch.setattr(sys, "stderr", stream)
        monkeypatch.setattr(progress.log, "isEnabledFor", lambda asked: asked >= level)
        model = block()
        rom.modes(model, 8)
        rom.reduce(model, method=rom.CraigBampton(4), interfaces={"root": "rbe2"})
        return [part.strip() for part in stream.getvalue().split("\r") if part.strip()]

    assert seen(logging.WARNING) == [
        "8 modes of 243 dofs    0 %", "residuals of 8 modes   50 %",
        "shapes of 243 dofs    0 %", "energies of 10 shapes   50 %",
        "compare with the full model, free    0 %",
        "compare with the full model, root held   50 %",
    ]  # fmt: skip
    assert seen(logging.ERROR) == []
