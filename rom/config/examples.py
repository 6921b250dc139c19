"""Geometries, files of parts and mechanisms, and demos, which come with rom."""

from pathlib import Path

from rom import places
from rom.arguments import typed
from rom.errors import UnknownNameError
from rom.names import check_known


def examples(pattern: str) -> dict[str, Path]:
    """{name: path} of demos, geometries, and files of parts and mechanisms."""
    paths = [p for kind in ("demos", "meshes") for p in (places.EXAMPLES / kind).glob(pattern)]
    return {p.name: p for p in sorted(paths) if p.suffix in (".geo", ".py", ".toml")}


@typed
def example(name: str) -> Path:
    """The path of a geometry, or of a file of a part or a mechanism, that comes with rom.

    Args:
        name: as in the folders that ``rom demo --copy`` writes.

    Raises:
        UnknownNameError: for another name.

    Example:
        >>> rom.example("slider_crank.toml").suffix
        '.toml'
    """
    known = examples("*.*")
    check_known(name, known, f"no example is called {name!r}; there are", UnknownNameError)
    return known[name]
