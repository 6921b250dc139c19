"""The site builds without a warning, and its generated pages say what the project is."""

import subprocess
import sys
from pathlib import Path

import pytest

import rom
from rom import errors
from rom.cli.parser import VERBS

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PARTS = """# # A title
#
# Some `code` in prose.
# Writes: `drawn.png` and `absent.png`

import rom

x = 1  # a remark
# a remark of its own

y = 2

# ## A section
#
# More prose.

z = 3
"""


@pytest.fixture
def pages(monkeypatch):
    pytest.importorskip("sphinx", reason="the site is built in the environment of the developers")
    monkeypatch.syspath_prepend(str(DOCS))
    import site_pages

    return site_pages


def test_a_demo_becomes_text_and_code(pages, tmp_path):
    script = tmp_path / "demo_x.py"
    script.write_text(PARTS)
    page = pages.demo_page(script, {"drawn.png": tmp_path / "drawn.png"})
    assert page.startswith("# A title\n\nSome `code` in prose.")
    assert "![Drawn](drawn.png)" in page and "Not drawn yet" in page and "`absent.png`." in page
    code = "import rom\n\nx = 1  # a remark\n# a remark of its own\n\ny = 2"
    assert f"```python\n{code}\n```\n\n## A section\n\nMore prose.\n\n```python\nz = 3" in page


def test_the_error_page_has_every_error(pages):
    kinds = [e for e in vars(errors).values() if isinstance(e, type) and hasattr(e, "exit_code")]
    page = pages.error_page()
    for kind in set(kinds) - {errors.RomError}:
        (row,) = (line for line in page.splitlines() if line.startswith(f"| `{kind.__name__}` |"))
        assert f"| {kind.exit_code} | {kind.__doc__.split()[0]}" in row
    assert set(pages.CURES) == {kind.__name__ for kind in kinds} - {"RomError"}


def test_every_public_name_has_its_place(pages):
    text = "\n".join(pages.interface_pages().values())
    for name in rom.__all__:
        assert f":: rom.{name}\n" in text


def test_every_verb_is_shown_with_its_help(pages):
    page = pages.command_page()
    for module in VERBS:
        assert f"## rom {module.__name__.rpartition('.')[2]}\n" in page
        assert module.EXAMPLES.splitlines()[0] in page


@pytest.mark.fenicsx
@pytest.mark.slow
def test_the_site_builds_without_warnings(tmp_path):
    pytest.importorskip("dolfinx", reason="docstrings of rom.fe need it")
    pytest.importorskip("sphinx", reason="the site is built in the environment of the developers")
    source = tmp_path / "docs"
    source.mkdir()
    for path in DOCS.iterdir():  # `make docs` may be writing into the folder itself
        if path.name not in ("generated", "__pycache__"):
            (source / path.name).symlink_to(path)
    command = [sys.executable, "-m", "sphinx", "-W", "-n", "-q", "--keep-going", source]
    done = subprocess.run([*command, tmp_path / "site"], capture_output=True, text=True,
                          timeout=240, check=False)  # fmt: skip
    assert done.returncode == 0, done.stderr
    site = {p.relative_to(tmp_path / "site").as_posix(): p for p in tmp_path.rglob("*.html")}
    assert {"index.html", "generated/errors.html", "generated/demo_beam.html"} <= set(site)
    for path in site.values():  # nothing is fetched when the site is read
        assert 'src="http' not in path.read_text() and '<link href="http' not in path.read_text()
