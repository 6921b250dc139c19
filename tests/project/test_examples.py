"""Examples in docstrings and notebooks run, and what is used most has one."""

import ast
import doctest
import inspect
import json
import re
from functools import cache
from importlib import import_module

import numpy as np
import pytest
from scipy.sparse import csr_matrix

import rom
from cases.command import environment
from cases.files.docstrings import Callable, definitions, pages_and_demos, public
from cases.paths import ROOT
from cases.solid import block

pytestmark = pytest.mark.once

MANY = 5  # calls of a name of rom in demos and pages, from which on it has an example
MAX_LINES = 7


@cache
def examples():
    found, seen = {}, set()
    for name, one in public().items():
        text = one.sections.get("Example", "")
        if text and id(inspect.unwrap(one.thing)) not in seen:
            seen.add(id(inspect.unwrap(one.thing)))
            found[name] = text
    path = ROOT / "rom" / "fe" / "elasticity.py"  # which cannot be imported everywhere
    text = ast.get_docstring(definitions(path)["model"])
    return found | {"rom.fe.model": Callable("", None, text).sections["Example"]}


EXAMPLES = examples()


@pytest.fixture(scope="module")
def beam(tmp_path_factory):
    path = tmp_path_factory.mktemp("beam") / "beam.rom.npz"
    model = block(size=(1.0, 0.05, 0.03), cells=(20, 2, 2))
    kinds = {"root": "rbe2", "tip": "rbe2"}
    rom.save(rom.reduce(model, method=rom.CraigBampton(4), interfaces=kinds), path)
    return path


@pytest.fixture(scope="module")
def models():
    """`rom.fe.model`, which makes the beam of all examples once."""
    made = {}

    def model(path, *, material):
        key = path, material
        made[key] = made.get(key) or rom.fe.elasticity.model(path, material=material)
        return made[key]

    return model


MESHED = [name for name, text in EXAMPLES.items() if "rom.fe." in text]


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.fenicsx] * (n in MESHED)) for n in EXAMPLES]
)
def test_example_runs(name, models, beam, tmp_path, monkeypatch):
    if name in MESHED:
        import_module("rom.fe.elasticity")
        monkeypatch.setattr(rom.fe, "model", models, raising=False)
    (tmp_path / "meshes").symlink_to(ROOT / "meshes")
    (tmp_path / "beam.rom.npz").symlink_to(beam)
    monkeypatch.chdir(tmp_path)
    names = {"rom": rom, "np": np, "csr_matrix": csr_matrix}
    test = doctest.DocTestParser().get_doctest(EXAMPLES[name], names, name, None, 0)
    assert 0 < len(test.examples) and any(example.want for example in test.examples)
    said = []
    failed = doctest.DocTestRunner(verbose=False).run(test, out=said.append).failed
    assert not failed, "".join(said)


def test_what_is_used_most_has_an_example():
    calls = re.findall(r"\brom\.([A-Za-z]\w+)\(", pages_and_demos())
    used = {f"{rom.MODULES[name]}.{name}" for name in rom.__all__ if calls.count(name) >= MANY}
    used = {name.replace("rom.material.", "rom.model.") for name in used}
    assert used <= set(EXAMPLES), sorted(used - set(EXAMPLES))
    assert len(EXAMPLES) >= 30
    assert max(len(text.strip().splitlines()) for text in EXAMPLES.values()) <= MAX_LINES


FOLDER = ROOT / "docs" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
NUMBER = re.compile(r"[-+]?\d[\d.]*(?:e[-+]?\d+)?")
STEEL_DENSITY = 7850.0  # [kg/m^3]


def printed(notebook):
    """What all cells have printed; what the last line of a cell shows is left out."""
    outputs = (out for cell in notebook.cells for out in cell.get("outputs", ()))
    return "\n".join(out.text for out in outputs if out.output_type == "stream")


def values(words, text):
    """The numbers of the one line that begins so."""
    (line,) = (line for line in text.splitlines() if line.startswith(words))
    return [float(x) for x in NUMBER.findall(line.removeprefix(words))]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    nbformat = pytest.importorskip("nbformat", reason="notebooks need the extra [docs]")
    nbclient = pytest.importorskip("nbclient", reason="notebooks need the extra [docs]")
    folder = tmp_path_factory.mktemp("notebooks")

    def text(name):
        notebook = nbformat.read(FOLDER / f"{name}.ipynb", as_version=4)
        resources = {"metadata": {"path": str(folder)}}
        client = nbclient.NotebookClient(notebook, timeout=600, resources=resources)
        client.execute(env=environment())
        return printed(notebook)

    return text


@pytest.fixture(scope="module")
def rod():
    """Mass [kg], centre (3,) [m] and inertia about z through the big eye [kg m^2], from the CAD."""
    gmsh = pytest.importorskip("gmsh", reason="gmsh is not installed")
    gmsh.initialize([], False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(ROOT / "meshes" / "connecting_rod.geo"))
        ((_, volume),) = gmsh.model.getEntities(3)
        mass = STEEL_DENSITY * gmsh.model.occ.getMass(3, volume)
        centre = np.array(gmsh.model.occ.getCenterOfMass(3, volume))
        about_centre = STEEL_DENSITY * gmsh.model.occ.getMatrixOfInertia(3, volume)[8]
    finally:
        gmsh.finalize()
    return mass, centre, about_centre + mass * (centre[0] ** 2 + centre[1] ** 2)


def test_notebooks_lie_here_without_outputs_and_the_site_names_them():
    index, start = ((ROOT / "docs" / f"{name}.md").read_text() for name in ("index", "start"))
    for path in NOTEBOOKS:
        assert f"(notebooks/{path.stem}.ipynb)" in index and f"\nnotebooks/{path.stem}\n" in start
        cells = [one for one in json.loads(path.read_text())["cells"] if one["cell_type"] == "code"]
        assert cells and not any(one["outputs"] or one["execution_count"] for one in cells)


@pytest.mark.fenicsx
@pytest.mark.long
def test_the_first_body_weighs_what_the_cad_says_in_every_frame(run, rod):
    text = run("first_body")
    assert values("mass:", text) == pytest.approx([rod[0]], rel=3e-4)  # of a coarse mesh
    assert values("rigid, free:", text) == pytest.approx([0] * 6, abs=0.01)
    (n_dofs,), (n,) = (
        values(words, text)
        for words in ("dofs of the full model:", "elastic coordinates of the body:")
    )
    assert n_dofs > 10_000 and 6 <= n < 60
    full = values("held at pin_a:", text)
    for frame in ("pin_a", "('pin_a', 'pin_b')", "mean-axis"):
        reduced = values(f"frame {frame}:", text)
        assert len(reduced) == 3 and reduced == pytest.approx(full, rel=1e-3)
        assert reduced == pytest.approx(values("frame pin_a:", text), rel=1e-6)


@pytest.mark.fenicsx
@pytest.mark.long
def test_the_first_mechanism_is_a_pendulum_on_a_spring(run, rod):
    text = run("first_mechanism")
    mass, centre, about_hinge = rod
    stiffness, arm = 2e3, 0.2  # [N/m], [m]
    frequency = np.sqrt(stiffness * arm**2 / about_hinge) / (2 * np.pi)
    pull = mass * 9.81 * centre[0] / arm
    assert values("frequencies about it:", text)[0] == pytest.approx(frequency, rel=1e-3)
    assert values("rigid rod:", text) == pytest.approx([frequency], rel=3e-4)
    assert values("pull of the spring at rest:", text) == pytest.approx([pull], rel=3e-4)
    assert values("damping ratios:", text)[0] == pytest.approx(
        1.0 * arm**2 / (2 * about_hinge * 2 * np.pi * frequency), rel=1e-3
    )
    sag = np.rad2deg(pull / stiffness / arm)
    assert sag < values("the rod sinks by at most:", text)[0] < 2 * sag


@pytest.mark.fenicsx
@pytest.mark.mpi
@pytest.mark.long
def test_one_process_two_and_every_solver_find_the_same_beam(run):
    text = run("parallel_and_large")
    one, two = values("one process:", text), values("two processes:", text)
    assert len(one) == 4 and two == pytest.approx(one, rel=1e-7)  # as many digits are printed
    assert values("largest difference:", text)[0] < 1e-9
    bending = 1.8751041**2 / (2 * np.pi) * np.sqrt(210e9 / 7850 / 12) * np.array([0.03, 0.05])
    assert values("closed form:", text) == pytest.approx(bending[:1], abs=1e-3)
    assert one[:2] == pytest.approx(bending, rel=5e-3)
    direct = values("direct:", text)
    assert direct[:2] == pytest.approx(one[:2], rel=1e-4)
    for solver in ("low-rank", "iterative"):
        assert values(f"{solver}:", text) == pytest.approx(direct, rel=1e-6)
