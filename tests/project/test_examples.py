"""Examples in docstrings run, and what is used most has one."""

import ast
import doctest
import inspect
import re
from functools import cache

import numpy as np
import pytest
from scipy.sparse import csr_matrix

import rom
from cases.files.docstrings import Callable, definitions, pages_and_demos, public
from cases.paths import ROOT
from cases.solid import block

pytestmark = pytest.mark.once

MANY = 5  # calls of a name of rom in demos and pages, from which on it has an example
MAX_LINES = 7


@cache
def examples():
    """{name: example} of everything public, each function once."""
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
    """The body that examples load: of steel, 1 m x 50 mm x 30 mm, reduced to its ends."""
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


@pytest.mark.fenicsx
@pytest.mark.parametrize("name", [n for n, text in EXAMPLES.items() if "rom.fe." in text])
def test_example_with_a_mesh_runs(name, models, beam, tmp_path, monkeypatch):
    import rom.fe.elasticity

    monkeypatch.setattr(rom.fe, "model", models, raising=False)
    run(name, beam, tmp_path, monkeypatch)


@pytest.mark.parametrize("name", [n for n, text in EXAMPLES.items() if "rom.fe." not in text])
def test_example_runs(name, beam, tmp_path, monkeypatch):
    run(name, beam, tmp_path, monkeypatch)


def run(name, beam, folder, monkeypatch):
    (folder / "meshes").symlink_to(ROOT / "meshes")
    (folder / "beam.rom.npz").symlink_to(beam)
    monkeypatch.chdir(folder)
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
