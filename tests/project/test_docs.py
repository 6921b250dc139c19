"""The site builds without a warning, and its generated pages say what the project is."""

import csv
import importlib
import json
import re
import shlex
import shutil
import sys

import numpy as np
import pytest

import rom
from cases import command
from cases.command import ROOT, ran
from cases.files.docstrings import PAGES, commands
from cases.solid import block, composite

DOCS = ROOT / "docs"
CODE = re.compile(r"^```python\n(.*?)^```$", re.M | re.S)
TOUR = DOCS / "tour.md"  # its blocks start from files of their own
STEP_PART = DOCS / "step_part.md"
TRIED = [path for path in PAGES[1:] if path != TOUR and CODE.search(path.read_text())]


@pytest.fixture
def pages(monkeypatch):
    pytest.importorskip("sphinx", reason="the site is built in the environment of the developers")
    monkeypatch.syspath_prepend(str(DOCS))
    import site_pages

    return site_pages


def test_the_page_of_demos_has_each_with_its_small_picture(pages, tmp_path):
    named = [f"demo_{name}" for names in pages.SUBJECTS.values() for name in names.split()]
    scripts = sorted(pages.DEMOS.glob("demo_*.py"))
    assert sorted(named) == [script.stem for script in scripts]
    page = pages.gallery_page()
    entries = dict(zip(named, page.split("\n:::{grid-item-card} ")[1:], strict=True))
    for script in scripts:
        title = script.read_text().split("\n")[0].removeprefix("# # ")
        assert entries[script.stem].startswith(f"{title}\n:link: {script.stem}\n:link-type: doc\n")
        kept = pages.THUMBNAILS / f"{script.stem}.png"
        assert (f"\n:img-top: ../thumbnails/{kept.name}\n" in entries[script.stem]) == kept.exists()
        draws = pages.PICTURE.search(script.read_text())
        assert kept.exists() or not draws, f"{script.name}: run it, then make thumbnails"
    assert ":img-top:" not in pages.gallery_page(tmp_path)


def public_names():
    """What `rom` and the packages that it names have for users, as a page of the site calls it."""
    found = dict(rom.MODULES)
    for package in rom.PACKAGES:
        front = importlib.import_module(f"rom.{package}")
        if package in ("rotation", "units"):
            own = {n: f"rom.{package}" for n, x in vars(front).items()
                   if n[0] != "_" and getattr(x, "__module__", "") == front.__name__}  # fmt: skip
        elif package == "fe":
            own = dict.fromkeys(front.__all__, "rom.fe")
        elif package == "components":
            own = dict.fromkeys(front.PACKAGES, "rom.components")
        else:
            own = {name: place for name, place in getattr(front, "MODULES", {}).items()
                   if callable(getattr(front, name))}  # fmt: skip
        found |= {f"{package}.{name}": place for name, place in own.items()
                  if rom.MODULES.get(name) != place}  # fmt: skip
    return set(found)


def test_every_public_name_stands_exactly_once_among_the_tasks(pages):
    named = [name for _, names in pages.TASKS.values() for name in names.split()]
    assert set(named) == public_names() and len(named) == len(set(named))
    files = {pages.FILE_NAMES.get(name, name).lower() for name in pages.NAMES}
    assert len(files) == len(named)  # some file systems do not tell capitals
    shown = pages.interface_pages()
    tasks = "\n".join(text for page, text in shown.items() if page.startswith("task_"))
    listed = re.findall(r"^   rom\.(\S+)$", tasks, re.M)
    assert sorted(listed) == sorted(name for name in named if not name.startswith("components."))
    assert listed[0] == "Mechanism" and "   rom.mbs.Solution\n" in shown["rom_mbs.rst"]
    for page in set(shown) - {"interface.rst"}:
        assert f"\n   {page.removesuffix('.rst')}\n" in shown["interface.rst"]


@pytest.mark.long
@pytest.mark.fenicsx
@pytest.mark.slow
def test_the_site_builds_without_warnings(tmp_path):
    pytest.importorskip("sphinx", reason="the site is built in the environment of the developers")
    source = tmp_path / "docs"  # `make docs` may be writing into the folder itself
    left = shutil.ignore_patterns("generated", "__pycache__", "*.npz")
    shutil.copytree(DOCS, source, ignore=left)
    command = [sys.executable, "-m", "sphinx", "-W", "-n", "-q", "--keep-going", source]
    done = ran(*command, tmp_path / "site", timeout=600)
    assert done.returncode == 0, done.stderr
    site = {p.relative_to(tmp_path / "site").as_posix(): p for p in tmp_path.rglob("*.html")}
    assert {"index.html", "generated/errors.html", "generated/demo_beam.html"} <= set(site)
    body = site["generated/api/rom.FlexibleBody.html"].read_text()
    assert "rom.FlexibleBody.marker" in body and "rom.body.Marker" in body  # inherited; a type
    for path in site.values():  # nothing is fetched when the site is read
        assert 'src="http' not in path.read_text() and '<link href="http' not in path.read_text()


@pytest.fixture(scope="module")
def beam(tmp_path_factory):
    """What the first page makes of a mesh, here from bricks, so that FEniCSx is not needed."""
    path = tmp_path_factory.mktemp("beam") / "beam.rom.npz"
    kinds = {"root": "rbe2", "tip": "rbe2"}
    model = block(size=(1.0, 0.05, 0.03), cells=(20, 2, 2))
    rom.save(rom.reduce(model, interfaces=kinds), path)
    return path


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
@pytest.mark.parametrize("page", TRIED, ids=lambda path: path.stem)
def test_code_on_a_page_runs(page, beam, tmp_path, monkeypatch):
    text = page.read_text()
    if "rom.fe" in text or "rom.view" in text:
        pytest.importorskip("dolfinx", reason="the page starts from finite elements")
    monkeypatch.chdir(tmp_path)
    (tmp_path / "beam.rom.npz").symlink_to(beam)
    (tmp_path / "meshes").symlink_to(ROOT / "meshes")
    names = {"__name__": "__main__"}
    for found in CODE.finditer(text):
        line = text.count("\n", 0, found.start(1))
        exec(compile("\n" * line + found.group(1), str(page), "exec"), names)
    if page == STEP_PART:
        lever_balances(names)


def lever_balances(names):
    """Statics of the bell crank, about its pivot; arms that bend vibrate more slowly."""
    assert names["crank"].certificate.ok and rom.audit(names["sol"]).ok
    weight = names["crank"].first_moment[0] * 9.81  # [N m]
    turned = np.arctan2(*(names["rest"].q[[6, 3]])) * 2  # [rad]
    assert 0 < turned < 0.03
    assert -names["pull"] == pytest.approx((400 * 0.12 - weight) / 0.08, rel=5e-3)
    assert 0.9 * names["rigid"] < names["flexible"] < 0.99 * names["rigid"]


@pytest.mark.fenicsx
@pytest.mark.long
def test_commands_of_the_page_about_a_part_run(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = STEP_PART.read_text()
    exec(CODE.search(text).group(1), {})
    (mechanism,) = re.findall(r"^```toml\n(.*?)^```$", text, re.M | re.S)
    (tmp_path / "push.toml").write_text(mechanism)
    said = {}
    for line in commands(STEP_PART):
        program, verb, *arguments = shlex.split(line)
        assert program == "rom"
        done = command.rom(verb, *arguments, "--json", cwd=tmp_path, timeout=600)
        assert done.returncode == 0, (line, done.stderr)
        said.setdefault(verb, json.loads(done.stdout))
    radii = {face["number"]: face["radius"] for face in said["mesh"]["faces"]}
    assert [radii[k] for k in (15, 17, 20)] == pytest.approx([0.01, 0.006, 0.005])
    n_dofs = said["reduce"]["provenance"]["reduction"]["full dofs"]
    assert n_dofs == pytest.approx(12_675, rel=0.2)  # other versions of gmsh mesh otherwise
    with open(tmp_path / "run" / "motion.csv") as file:
        pulls = [float(row["suspension force x [N]"]) for row in csv.DictReader(file)]
    assert pulls[-1] == pytest.approx(600, rel=5e-3)
    assert max(pulls) == pytest.approx(1080, rel=5e-3)
    assert {path.name for path in tmp_path.iterdir()} == {
        "bell_crank.step", "faces.png", "bell_crank.rom.npz", "swing", "push.toml", "run",
        "push.html",
    }  # fmt: skip


def bar_deck(folder):
    """Matrices and nodes of a bar in mm, t and s, as another program leaves them: rod.op4, .bdf."""
    steel = rom.Material(E=210e3, nu=0.3, rho=7.85e-9)
    model = block(size=(200.0, 20.0, 10.0), cells=(7, 1, 1), material=steel)
    rom.io.write_op4({"KAA": model.K.toarray(), "MAA": model.M.toarray()}, folder / "rod.op4")
    sections = [10 * (k // 4 + 1) + k % 4 + 1 for k in range(len(model.points))]
    lines = [
        f"GRID,{number},," + ",".join(f"{x:.6f}" for x in point)
        for number, point in zip(sections, model.points, strict=True)
    ]
    (folder / "rod.bdf").write_text("BEGIN BULK\n" + "\n".join(lines) + "\nENDDATA\n")


def panel():
    core = rom.Material(E=1e9, nu=0.3, rho=200.0)
    materials = {"skin": rom.Material(E=70e9, nu=0.3, rho=2700.0), "core": core}
    return composite(materials, lambda cell: "core" if cell[2] == 1 else "skin", cells=(8, 2, 3))


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
def test_code_on_the_tour_runs(tmp_path, monkeypatch):
    pytest.importorskip("matplotlib", reason="its curves are pictures")
    monkeypatch.chdir(tmp_path)
    bar_deck(tmp_path)
    drawn = []
    monkeypatch.setattr(rom.view, "animate", lambda *a, **k: drawn.append(a[2]))
    blocks = CODE.findall(TOUR.read_text())
    assert any(CODE.findall((ROOT / "README.md").read_text())[1] in block for block in blocks)
    names = {"__name__": "__main__", "model": panel(), "rom": rom}
    for text in blocks:
        if "read_model" in text:  # its model is not that of the next block
            own = dict(names)
            exec(compile(text, str(TOUR), "exec"), own)
            rom.save(own["body"], "rod.rom.npz")
            assert own["body"].mass == pytest.approx(7850 * 4e-5, rel=1e-9)
        else:
            exec(compile(text, str(TOUR), "exec"), names)
    assert drawn == ["pendulum.gif"] and len(blocks) == 3
    assert {"pendulum.csv", "pendulum.glb", "panel.rom.npz"} <= {p.name for p in tmp_path.iterdir()}


def test_pages_of_theory_name_their_sources_and_all_pages_what_exists():
    for path in (DOCS / "theory").glob("*.md"):
        text = path.read_text()
        assert path.stem == "index" or ("\n## Sources\n" in text and CODE.search(text)), path
    tests = {path: path.read_text() for path in (ROOT / "tests").rglob("test_*.py")}
    known = {path.stem for path in tests}.union(
        *(re.findall(r"def (test_\w+)", text) for text in tests.values())
    )
    exists = {  # what is written in backquotes: whether there is such a thing
        r"`(rom(?:\.\w+)+)(?:\(.*?\))?`": named,
        r"`((?:meshes|demos|tests|rom|docs|\.ci)/[\w./-]+)`": lambda name: (ROOT / name).exists(),
        r"`([A-Z_]+)` of `([\w./]+)`": lambda name, path: re.search(
            rf"^{name}\b", (ROOT / path).read_text(), re.M
        ),
        r"`(test_\w+)`": known.__contains__,
        r"`(test_\w+)\.\.\.`": lambda name: any(one.startswith(name) for one in known),
    }
    for path in (*PAGES, ROOT / "CHANGELOG.md", ROOT / "CONTRIBUTING.md"):
        text = path.read_text()
        gone = [x for pattern, there in exists.items() for x in re.findall(pattern, text)
                if not there(*[x] if isinstance(x, str) else x)]  # fmt: skip
        assert not gone, f"{path.name} names {gone}"
    assert len(re.findall(r"`test_\w+`", (DOCS / "claims.md").read_text())) > 30  # with a claim


def named(name):
    """The module, function or class that a dotted name stands for; of rom.fe only the file."""
    thing = rom
    for part in name.split(".")[1:]:
        if thing is rom.fe:
            return part in rom.fe.__all__ or any((ROOT / "rom" / "fe").glob(f"{part}*"))
        try:
            thing = getattr(thing, part)
        except AttributeError:
            thing = importlib.import_module(f"{thing.__name__}.{part}")
    return thing
