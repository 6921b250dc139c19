"""Reports: `html` writes them, `pages` fills them for bodies, `run` for motions."""

from rom.lazy import front

__all__ = [
    "KINDS",
    "MAX_PICTURE_BYTES",
    "PAGE_STYLE",
    "checks",
    "paragraph",
    "picture",
    "source",
    "table",
    "write_report",
]
__getattr__ = front(__name__, "html", __all__)
