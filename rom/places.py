"""Where the package and its examples lie; nobody else counts folders upwards."""

from pathlib import Path

PACKAGE = Path(__file__).resolve().parent
# what a search path holds to find the package; the root of the source tree, where there is one
FOLDER_ABOVE = PACKAGE.parent
# with demos/ and meshes/: a part of the package where it was installed, else the source tree
EXAMPLES = PACKAGE / "examples" if (PACKAGE / "examples").is_dir() else FOLDER_ABOVE
