"""Finished films: what functions of `rom.view` give back, and their files."""

import base64
import io
import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from rom.arguments import typed
from rom.errors import ConfigError, ResourceError
from rom.io.files import write_whole
from rom.names import ORIGIN_MARK
from rom.process.child import run, scratch
from rom.view.canvas.offscreen import Image, checked, require

ENDINGS = (".gif", ".mp4")
ENCODER_PROGRAM = "ffmpeg"


@typed
@dataclass(frozen=True, slots=True, eq=False)
class Film:
    """A finished film; notebooks show it, `save` writes it.

    Attributes:
        pages: (f, height, width, 3) its pictures, whole numbers from 0 to 255.
        duration: of each picture [s].
        path: where it was written, or None; the film may stand for this path.
    """

    pages: Any
    duration: float
    path: str | Path | None = None

    def save(self, path: str | Path) -> Path:
        """Write it as .gif, or as .mp4 by ffmpeg; whole or not at all.

        Raises:
            ConfigError: for another ending, or a place that is not writable.
            ResourceError: if ffmpeg is missing or fails.
        """
        place = film_path(path)
        data = mp4(self) if place.suffix.lower() == ".mp4" else gif(self.pages, self.duration)
        return write_whole(place, data)

    def __repr__(self) -> str:
        f, height, width, _ = self.pages.shape
        return f"Film({f} pictures of {width} x {height}, {f * self.duration:.3g} s)"

    def __fspath__(self) -> str:
        if self.path is None:
            raise ConfigError("this film was not written yet.", hint="film.save(path) does.")
        return str(self.path)

    def _repr_html_(self) -> str:
        code = base64.b64encode(gif(self.pages, self.duration)).decode("ascii")
        return f"<img alt='{self!r}' src='data:image/gif;base64,{code}'>"


def film_path(path: str | Path) -> Path:
    """The path, if a film of that ending can be made and written; to be asked before drawing."""
    place = checked(path, *ENDINGS)
    if place.suffix.lower() == ".mp4":
        encoder()
    return place


def wanted(path: str | Path | None) -> Path | None:
    """The path of a film, checked, if it is to be written."""
    return None if path is None else film_path(path)


def finished(pages: Image, duration: float, path: Path | None) -> Film:
    """The film, written where there is a path."""
    film = Film(pages, duration)
    return film if path is None else replace(film, path=film.save(path))


def encoder() -> str:
    """The program that makes .mp4."""
    found = shutil.which(ENCODER_PROGRAM)
    if found is None:
        raise ResourceError(
            f".mp4 needs {ENCODER_PROGRAM}, which is not on the PATH.",
            hint=f"apt install {ENCODER_PROGRAM}, or write the film as .gif.",
        )
    return found


def mp4(film: Film) -> bytes:
    """The bytes of a film in H.264, for every player."""
    pages = even(film.pages)
    height, width = pages.shape[1:3]
    with scratch("film") as folder:
        out = folder / "film.mp4"
        command = [encoder(), "-v", "error", "-f", "rawvideo", "-pix_fmt", "rgb24"]
        command += ["-s", f"{width}x{height}", "-framerate", f"{1 / film.duration:.6f}", "-i", "-"]
        command += ["-c:v", "libx264", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
        command += ["-metadata", f"comment={ORIGIN_MARK}", str(out)]
        done = run(command, given=pages.tobytes())
        if done.code or not out.is_file():
            raise ResourceError(
                f"{ENCODER_PROGRAM} ended with code {done.code}: {done.last}.",
                hint=f"This needs a build of {ENCODER_PROGRAM} with libx264; .gif needs nothing.",
            )
        return out.read_bytes()


def even(pages: Image) -> Image:
    """Pictures of even height and width, as yuv420p needs: the last row or column twice."""
    height, width = pages.shape[1:3]
    rows, columns = ((0, n % 2) for n in (height, width))
    return np.pad(pages, ((0, 0), rows, columns, (0, 0)), mode="edge")


def gif(pages: Image, duration: float) -> bytes:
    """The bytes of a film; one palette for all pictures, so that colours do not flicker."""
    require("PIL")
    from PIL import Image as Picture

    pictures = [Picture.fromarray(p) for p in pages]
    colours = pages[:: max(1, len(pages) // 8)].reshape(-1, 3)
    drawn = colours[colours.min(axis=1) < 250]  # white paper would take most of the palette
    sample = np.vstack([drawn, np.full((len(drawn) // 100 + 1, 3), 255, np.uint8)])
    how = Picture.Quantize.MEDIANCUT
    palette = Picture.fromarray(sample[None]).quantize(256, method=how, kmeans=2)
    first, *others = (p.quantize(palette=palette, dither=Picture.Dither.NONE) for p in pictures)
    buffer = io.BytesIO()
    told = {"duration": max(20, round(1000 * duration)), "comment": ORIGIN_MARK.encode()}
    first.save(buffer, format="GIF", save_all=True, append_images=others, loop=0, **told)
    return buffer.getvalue()
