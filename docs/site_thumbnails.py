"""Small pictures of the demos for the page that lists them, by ``make thumbnails``.

They are kept, so that a site has them where no demo has run.
"""

from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image
from site_pages import DEMOS, PICTURE, PICTURES, THUMBNAILS

WIDTH, HEIGHT = 240, 170  # [pixel]
COLOURS = 128
WHITE = 250  # and brighter is paper
HEADING = 0.035  # a line of text at the top is lower, of the width


def shown(script: Path, folders: tuple[Path, ...] = PICTURES) -> Path | None:
    """What a demo shows best: its film, else its modes, else what it names first.

    Args:
        script: a demo.
        folders: where its pictures lie, if it has run.

    Returns:
        A picture that is there, or None.
    """
    names = dict.fromkeys(PICTURE.findall(script.read_text()))
    found = [folder / name for name in names for folder in folders if (folder / name).exists()]
    return min(found, key=lambda p: (p.suffix != ".gif", "modes" not in p.stem), default=None)


def thumbnail(picture: Path, path: Path) -> None:
    """The upper part of a picture without its heading, or the middle of a film, all of it.

    Args:
        picture: .png or .gif.
        path: file to write, .png of `WIDTH` times `HEIGHT`.
    """
    with Image.open(picture) as image:
        n_frames = getattr(image, "n_frames", 1)
        image.seek(n_frames // 2)
        inner = Image.fromarray(_within(np.asarray(image.convert("RGB"))))
    scale = WIDTH / inner.width
    if n_frames > 1:
        scale = min(scale, HEIGHT / inner.height)
    size = round(inner.width * scale), round(inner.height * scale)
    page = Image.new("RGB", (WIDTH, HEIGHT), "white")
    corner = (WIDTH - size[0]) // 2, max(0, (HEIGHT - size[1]) // 2)
    page.paste(inner.resize(size, Image.Resampling.LANCZOS), corner)
    path.parent.mkdir(exist_ok=True)
    few = page.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    few.save(path, optimize=True)


def _within(colours: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """Pixels (n, m, 3) inside the white margins and below a first line of text."""
    inked = (colours < WHITE).any(axis=2)
    rows = np.flatnonzero(inked.any(axis=1))
    gaps = np.flatnonzero(np.diff(rows) > 1)
    if gaps.size and gaps[0] < HEADING * colours.shape[1]:
        rows = rows[gaps[0] + 1 :]
    columns = np.flatnonzero(inked[rows].any(axis=0))
    return colours[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]


if __name__ == "__main__":
    for demo in sorted(DEMOS.glob("demo_*.py")):
        if best := shown(demo):
            thumbnail(best, THUMBNAILS / f"{demo.stem}.png")
