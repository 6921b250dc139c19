"""Entry of ``rom …`` and ``python -m rom …``."""

import sys

from rom.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
