"""Entry of ``rom …`` and ``python -m rom …``."""

import os
import sys


def leave_working_folder() -> None:
    """Take the working folder off the path of modules, unless PYTHONPATH names it in full.

    ``python -m`` puts it first, and an empty or relative entry of PYTHONPATH stands for it; a file
    that happens to lie there, such as numpy.py, would be run. rom itself is found already.
    """
    if not sys.flags.safe_path and sys.path[0] == os.getcwd():
        del sys.path[0]
    given = os.environ.get("PYTHONPATH")
    for entry in given.split(os.pathsep) if given else ():
        path = os.path.abspath(entry)
        if not os.path.isabs(entry) and path in sys.path:
            sys.path.remove(path)


leave_working_folder()

from rom.process.interruption import heed_lost_signals  # noqa: E402
from rom.process.seclusion import leave_working_folder_alone  # noqa: E402

heed_lost_signals()
leave_working_folder_alone()

from rom.cli.main import main  # noqa: E402

if __name__ == "__main__":
    sys.exit(main())
