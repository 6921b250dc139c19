"""Where the package lies, and what comes with it; nobody else counts folders upwards."""

from pathlib import Path

from rom.errors import UnknownNameError
from rom.names import check_known

PACKAGE = Path(__file__).resolve().parent
# what a search path holds to find the package; the root of the source tree, where there is one
FOLDER_ABOVE = PACKAGE.parent
# with demos/ and meshes/: a part of the package where it was installed, else the source tree
EXAMPLES = PACKAGE / "examples" if (PACKAGE / "examples").is_dir() else FOLDER_ABOVE


def examples(pattern: str) -> dict[str, Path]:
    """{name: path} of demos, geometries, and files of parts and mechanisms."""
    paths = [p for kind in ("demos", "meshes") for p in (EXAMPLES / kind).glob(pattern)]
    return {p.name: p for p in sorted(paths) if p.suffix in (".geo", ".py", ".toml")}


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
