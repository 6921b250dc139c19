"""Figures of matplotlib as functions of `rom.view` give them back, and ticks in other units."""

import io
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backend_bases import RendererBase
from matplotlib.figure import Figure
from matplotlib.ticker import Formatter, MaxNLocator

from rom.errors import ConfigError
from rom.io.files import write_whole
from rom.view.canvas.offscreen import checked, styled


class Picture(Figure):
    """A finished figure; notebooks show it, `save` writes it."""

    # where it was written last, or None; the picture may stand for this path
    path: Path | None = None

    def save(self, path: str | Path) -> Path:
        """Write it as .png, whole or not at all."""
        self.path = written(self, checked(path, ".png"))
        return self.path

    def draw(self, renderer: RendererBase) -> None:
        """Ticks that are made while it is drawn have the look of the house, too."""
        with styled():
            super().draw(renderer)

    def __fspath__(self) -> str:
        if self.path is None:
            raise ConfigError("this picture was not written yet.", hint="picture.save(path) does.")
        return str(self.path)

    def _repr_png_(self) -> bytes:
        return png(self)


def png(figure: Figure) -> bytes:
    """The bytes of its file, pixel for pixel."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi="figure", metadata={"Software": "rom"})
    return buffer.getvalue()


def written(figure: Figure, path: Path) -> Path:
    """Write any figure as PNG, whole or not at all."""
    return write_whole(path, png(figure))


class ScaledPlaces(MaxNLocator):
    """Ticks at round values of a multiple of what is drawn."""

    def __init__(self, factor: float):
        super().__init__(nbins="auto", steps=[1, 2, 2.5, 5, 10])
        self.factor = factor

    def tick_values(self, vmin: float, vmax: float) -> Any:
        """Where the ticks are between two values."""
        values = super().tick_values(self.factor * vmin, self.factor * vmax)
        return np.asarray(values) / self.factor


class ScaledTicks(Formatter):
    """Labels of ticks in a multiple of what is drawn, with as many digits as tell them apart."""

    def __init__(self, factor: float):
        self.factor, self.digits, self.written = factor, 6, 0

    def set_locs(self, locs: list[float]) -> None:
        """Choose the digits from the distance of the ticks."""
        super().set_locs(locs)
        steps = np.abs(np.diff(self.factor * np.unique(locs)))
        if steps.size:
            self.digits = max(0, 2 - int(np.floor(np.log10(steps.min()))))
        numbers = [f"{abs(self.factor * x):.{self.digits}f}" for x in np.unique(locs)]
        self.written = max((len(x.rstrip("0").partition(".")[2]) for x in numbers), default=0)

    def __call__(self, x: float, pos: int | None = None) -> str:
        """The label of one tick."""
        value = round(self.factor * x, self.digits) + 0.0
        return f"{value:.{self.written}f}".replace("-", "\u2212")
