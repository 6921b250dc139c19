"""What pyproject.toml cannot say: demos and meshes go into the wheel from where they lie."""

from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py


class BuildWithExamples(build_py):
    """Puts them into the package; an editable install finds those of its clone."""

    def run(self) -> None:
        """Build, and copy."""
        super().run()
        if not self.editable_mode:
            for path in (*Path("demos").glob("*.[pt]*"), *Path("meshes").glob("*.*")):
                target = Path(self.build_lib, "rom", "examples", path)
                self.mkpath(str(target.parent))
                self.copy_file(str(path), str(target))


setup(cmdclass={"build_py": BuildWithExamples})
