"""Films as GIF files."""

import io

import numpy as np

from rom.names import ORIGIN_MARK
from rom.view.canvas.offscreen import Image, require


def gif(pages: Image, duration: float) -> bytes:
    """The bytes of a film; one palette for all pictures, so that colours do not flicker.

    Args:
        pages: (f, height, width, 3) pictures.
        duration: of each [s].
    """
    require("PIL")
    from PIL import Image as Picture

    pictures = [Picture.fromarray(p) for p in pages]
    colours = pages[:: max(1, len(pages) // 8)].reshape(-1, 3)
    drawn = colours[colours.min(axis=1) < 250]  # white paper would take most of the palette
    sample = np.vstack([drawn, np.full((len(drawn) // 100 + 1, 3), 255, np.uint8)])
    palette = Picture.fromarray(sample[None]).quantize(
        256, method=Picture.Quantize.MEDIANCUT, kmeans=2
    )
    frames = [p.quantize(palette=palette, dither=Picture.Dither.NONE) for p in pictures]
    buffer = io.BytesIO()
    frames[0].save(
        buffer,
        format="GIF",
        save_all=True,
        append_images=frames[1:],
        duration=max(20, round(1000 * duration)),
        loop=0,
        comment=ORIGIN_MARK.encode(),
    )
    return buffer.getvalue()
