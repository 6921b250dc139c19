"""Where the package lies; nobody else counts folders upwards."""

from pathlib import Path

PACKAGE = Path(__file__).resolve().parent
# what a search path holds to find the package; the root of the source tree, where there is one
FOLDER_ABOVE = PACKAGE.parent
