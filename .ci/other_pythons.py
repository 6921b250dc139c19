"""Say which other Pythons there are wheels for, and that none of them is tested by this run."""

import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

OLDEST, NEWEST = 12, 15  # minor versions of Python 3
LOOK = "install --dry-run -q --disable-pip-version-check --only-binary=:all:".split()

project = tomllib.loads(Path(__file__).parents[1].joinpath("pyproject.toml").read_text())["project"]
extras = project["optional-dependencies"]
wanted = [*project["dependencies"], *extras["fe"], *extras["view"]]
for minor in range(OLDEST, NEWEST + 1):
    if minor == sys.version_info.minor:
        continue
    with tempfile.TemporaryDirectory() as folder:
        other = ["--target", folder, "--python-version", f"3.{minor}"]
        done = subprocess.run([sys.executable, "-m", "pip", *LOOK, *other, *wanted],
                              capture_output=True, text=True, check=False)  # fmt: skip
    found = "there are wheels of all libraries"
    if done.returncode:
        found = (done.stderr.strip().splitlines() or ["pip said nothing"])[-1]
    sys.stdout.write(f"Python 3.{minor} is not tested here; {found}\n")
