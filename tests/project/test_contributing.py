"""The page for contributors names lists that exist, and its picture follows the source."""

import re
import shutil

import pytest

from cases.paths import ROOT

pytestmark = pytest.mark.once
PAGE = ROOT / "docs" / "contributing.md"
NAMED = re.compile(r"`([A-Z_]+)` of `([\w./]+)`")


def test_lists_named_on_the_page_exist():
    for name, path in NAMED.findall(PAGE.read_text()):
        assert re.search(rf"^{name}\b", (ROOT / path).read_text(), re.M), f"{name} of {path}"


def test_a_force_element_is_a_folder_and_a_line():
    """Outside it there are the list, and a name that users have from elsewhere."""
    (row,) = re.findall(r"^\| a force element.*$", PAGE.read_text(), re.M)
    assert "`rom/fields.py`" in row and "one folder in `rom/components/`" in row
    sources = {*(ROOT / "rom").rglob("*.py"), *(ROOT / "rom").rglob("*.pyi")}
    outside = sources - {*(ROOT / "rom" / "components").rglob("*")}
    know = {path for path in outside if re.search(r"\btendons?\b", path.read_text())}
    assert know == {ROOT / "rom" / "fields.py", ROOT / "rom" / "mbs" / "__init__.pyi"}


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
