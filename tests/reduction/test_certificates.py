"""Whatever was reduced carries its evidence, in the same words and with a verdict."""

import ast

import numpy as np
import pytest

import rom
from cases.files import border_calls as made
from cases.paths import ROOT
from rom.rows import N_COMPARED

pytestmark = [
    pytest.mark.filterwarnings("ignore::rom.errors.RomWarning"),
    pytest.mark.filterwarnings("ignore:Number of integration points"),
]
CB = rom.CraigBampton(12)


def bodies():
    return {name: rom.reduce(model, method=CB, interfaces=made.KINDS)
            for name, model in (("a", made.model()), ("b", made.behind()))}  # fmt: skip


def family():
    E = rom.YoungsModulus("web", 0.9, 1.1)
    return rom.reduce_parametric(made.regions(), parameters={"E": E}, method=CB, tol=0.1,
                                 interfaces=made.KINDS)  # fmt: skip


LIGHT = {  # class -> one of them
    "Assembly": lambda: rom.Assembly(bodies(), made.TOGETHER),
    "BodyFamily": family,
    "CondensedAssembly": lambda: rom.Assembly(bodies(), made.TOGETHER).reduced(3),
    "DualAssembly": lambda: rom.DualAssembly(made.free(), made.TOGETHER),
    "FlexibleBody": lambda: bodies()["a"],
    "FreeSubstructure": lambda: made.free()["a"],
    "MistunedWheel": made.mistuned,
}
FROM_FINITE_ELEMENTS = {
    "BladedWheel": made.bladed,
    "ReducedSector": lambda: rom.reduce_sector(made.wheel().sector, n_modes=N_COMPARED),
    "ReducedSpinUp": made.reduced_run_up,
    "SubstructuredSector": lambda: made.wheel().parts,
}
CASES = [*LIGHT.items()] + [
    pytest.param(
        *case, marks=[pytest.mark.fenicsx, pytest.mark.skipif(not made.FENICSX, reason="")]
    )
    for case in FROM_FINITE_ELEMENTS.items()
]


@pytest.mark.parametrize(("name", "make"), CASES)
def test_what_was_reduced_says_how_far_to_trust_it(name, make):
    reduced = make()
    report = reduced.certificate
    assert type(reduced).__name__ == name and isinstance(report, rom.Report)
    words = [row.quantity for row in report.rows]
    for said in ("worst error of", "reduced never below full"):  # of frequency_rows
        assert any(said in quantity for quantity in words), f"{said}: {words}"
    assert all(np.isfinite(row.value) and row.limit for row in report.rows)
    assert report.ok == all(row.ok for row in report.rows)
    assert str(report).startswith(f"{report.title}: {'ok' if report.ok else ''}")


def test_every_class_with_a_certificate_is_tried_here():
    found = set()
    for path in (ROOT / "rom").rglob("*.py"):
        for node in ast.parse(path.read_text()).body:
            names = [getattr(getattr(one, "target", one), "id", getattr(one, "name", ""))
                     for one in getattr(node, "body", ())]  # fmt: skip
            if isinstance(node, ast.ClassDef) and "certificate" in names:
                found.add(node.name)
    found.remove("Pieces")  # certified on demand: tests/assembly/test_pieces.py
    base = {"SubstructuredSector": "ReducedSector", "FlexibleBody": "BodyData"}
    assert found == {base.get(name, name) for name in (*LIGHT, *FROM_FINITE_ELEMENTS)}
