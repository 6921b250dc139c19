"""The page for contributors names files that exist, and all that a new thing takes."""

import re
import shutil
import tokenize
from functools import cache

import pytest

from cases.paths import ROOT

pytestmark = pytest.mark.once
PAGE = ROOT / "docs" / "contributing.md"
PATH = re.compile(r"`((?:rom|tests|docs|demos|meshes)/[\w./]*)`")
NAMED = re.compile(r"`([A-Z_]+)` of `([\w./]+)`")
# A member of each family: whatever names it in the code is a file that another one takes too.
MEMBERS = {
    "a reduction method": r"Herting|herting",
    "a kind of interface": r"FourierLegendre|fourier",
    "a joint": r"universal",
    "a file format": r"(write_)?radioss",
    "a verb of the command line": r"swing",
    "a picture": r"wheel_modes",
}
ELSEWHERE = {  # where the word means something else, or the member is used and no family listed
    "a kind of interface": ("rom/components/wheels/",),
    "a joint": ("rom/io/",),
    "a verb of the command line": ("rom/mbs/",),
    "a picture": ("rom/components/wheels/", "rom/cyclic/", "rom/__init__.pyi"),
}


def rows():
    """{what is added: its cell} of the table."""
    text = PAGE.read_text().partition("## Where do I add")[2]
    cells = (line.strip("| ").split(" | ", 1) for line in text.splitlines() if "| a " in line)
    return dict(cells)


def listed(cell):
    """Files below rom/ that a cell names, those of its folders too."""
    paths = [ROOT / name for name in PATH.findall(cell)]
    files = {file for path in paths if path.is_dir() for file in path.glob("*.py")}
    return {str(file.relative_to(ROOT)) for file in files | {p for p in paths if p.is_file()}}


def names(path):
    """Names, keywords and texts of a file of Python, comments and longer texts left out."""
    with path.open("rb") as stream:
        for token in tokenize.tokenize(stream.readline):
            if token.type in (tokenize.NAME, tokenize.STRING):
                yield token.string.strip("\"'")


@cache
def known():
    """{file below rom/: the words of its code}."""
    sources = [*(ROOT / "rom").rglob("*.py"), *(ROOT / "rom").rglob("*.pyi")]
    return {str(path.relative_to(ROOT)): set(names(path)) for path in sources}


def test_lists_named_on_the_page_exist():
    for name, path in NAMED.findall(PAGE.read_text()):
        assert re.search(rf"^{name}\b", (ROOT / path).read_text(), re.M), f"{name} of {path}"


@pytest.mark.parametrize("what", MEMBERS)
def test_a_row_names_all_files_that_know_a_member(what):
    member, row = re.compile(MEMBERS[what]), rows()[what]
    apart = ("rom/components/", *ELSEWHERE.get(what, ()))
    know = {name for name, words in known().items()
            if not name.startswith(apart) and any(map(member.fullmatch, words))}  # fmt: skip
    assert len(know) > 1 and know <= listed(row), sorted(know - listed(row))


def test_a_force_element_is_a_folder_and_a_line():
    """Outside it there are the list, and a name that users have from elsewhere."""
    (row,) = (cell for what, cell in rows().items() if what.startswith("a force element"))
    assert {"rom/fields.py"} <= listed(row) and "one folder in `rom/components/`" in row
    sources = {name: (ROOT / name).read_text() for name in known()}
    know = {name for name, text in sources.items() if re.search(r"\btendons?\b", text)}
    outside = {name for name in know if not name.startswith("rom/components/")}
    assert outside == {"rom/fields.py", "rom/mbs/__init__.pyi"}


@pytest.fixture
def flow(monkeypatch):
    pytest.importorskip("sphinx", reason="the site is built in the environment of the developers")
    pytest.importorskip("matplotlib", reason="pictures need matplotlib")
    monkeypatch.syspath_prepend(str(ROOT / "docs"))
    import site_flow

    return site_flow


def test_the_picture_has_a_place_for_all_modules(flow):
    """And the curves count what the source imports."""
    stages = {flow.stage_of(module) for module in flow.modules() if module}
    assert stages == {*flow.STAGES, flow.COMPONENTS, flow.FRONT, flow.GROUND}
    shown = sum(flow.files_in(part) for parts in flow.STAGES.values() for part in parts)
    staged = [m for m in flow.modules() if m and flow.stage_of(m) in flow.STAGES]
    assert (
        shown == len(staged) - 1
    )  # the front of reduction, whose folders are shown each by itself


def test_the_picture_follows_the_source(flow, tmp_path, monkeypatch):
    source = tmp_path / "rom"
    for name in ("body", "mbs"):
        (source / name).mkdir(parents=True)
        (source / name / "__init__.py").touch()
    (source / "body" / "one.py").write_text(
        "from rom.mbs.mechanism import A, B\nimport rom.view, rom.io\n"
    )
    assert flow.counted(source) == {("mechanism", "body"): 2, ("results", "body"): 1}
    assert flow.files_in("body", source) == 2
    with pytest.raises(KeyError, match="no class Basis"):
        flow.defined("Basis", source)
    shutil.rmtree(source / "body")
    assert not flow.counted(source)
    monkeypatch.setattr(flow, "SOURCE", source)
    (source / "optics").mkdir()
    with pytest.raises(KeyError, match=r"optics\.lens has no stage"):
        flow.stage_of("optics.lens")
