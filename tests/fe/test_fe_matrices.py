"""Matrices of other programs, solved by MUMPS in place of SciPy: the same bodies."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.refusals import refuses
from cases.structures.frames import Section, frame
from rom.config import component
from rom.errors import ConfigError
from rom.io.matrices.op4 import write_op4

pytestmark = pytest.mark.fenicsx

KINDS = [("rbe2", "rbe2"), ("rbe2", "rbe3"), ("rbe3", "rbe3"), ("full", "rbe2")]
METHODS = [rom.CraigBampton(12), rom.CraigBampton(f_max=60.0), rom.Rubin(12), rom.Herting(12)]


def grid(n=(12, 9), *, rotary=True):
    """Bars 0.1 m apart between nodes of six rows, with two nodes at each of two corners."""
    number = np.arange(n[0] * n[1]).reshape(n)
    bars = [np.column_stack([a.ravel(), b.ravel()])
            for a, b in ((number[:-1], number[1:]), (number[:, :-1], number[:, 1:]))]  # fmt: skip
    x, y = np.meshgrid(*map(np.arange, n), indexing="ij")
    points = 0.1 * np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    ends = {"a": number[0, :2], "b": number[-1, -2:]}
    return frame(points, np.concatenate(bars), Section(0.01, 0.012, rotary=rotary), ends)


@pytest.mark.parametrize("kinds", KINDS, ids="-".join)
@pytest.mark.parametrize("method", METHODS, ids=lambda m: f"{type(m).__name__} {m.f_max}"
                         if hasattr(m, "f_max") else type(m).__name__)  # fmt: skip
def test_bodies_are_those_of_scipy(kinds, method):
    """Averaged motions of two nodes that turn tie dofs that depend on each other."""
    model = grid()
    how = {"method": method, "interfaces": dict(zip("ab", kinds, strict=True)), "certify": False}
    one, other = (rom.reduce(m, **how) for m in (model, rom.fe.by_mumps(model)))
    assert_allclose(other.frequencies(12, fixed=("a",)), one.frequencies(12, fixed=("a",)),
                    rtol=1e-8)  # fmt: skip
    assert_allclose(other.inertia, one.inertia, rtol=1e-9, atol=1e-9 * one.inertia.max())
    assert other.mass == pytest.approx(one.mass, rel=1e-12)


def test_rotations_without_inertia_and_the_mass():
    model = grid(rotary=False)
    by_mumps = rom.fe.by_mumps(model)
    assert by_mumps.mass() == pytest.approx(model.mass(), rel=1e-14)
    one, other = (rom.modes(m, 9, fixed=("a",)).frequencies for m in (model, by_mumps))
    assert_allclose(other, one, rtol=1e-9)
    body = rom.reduce(by_mumps, method=rom.CraigBampton(30), interfaces={"a": "rbe2", "b": "rbe3"})
    assert body.certificate.ok, body.certificate


def test_what_mumps_solves_already_is_refused():
    model = rom.fe.by_mumps(grid((3, 3)))
    refuses(ConfigError, "MUMPS solves already", rom.fe.by_mumps, model)


def test_large_matrices_of_files_go_to_mumps(tmp_path, monkeypatch):
    model = grid((4, 3))
    n = len(model.points)
    order = np.concatenate([[*(3 * k + np.arange(3)), *(3 * (n + k) + np.arange(3))]
                            for k in range(n)])  # fmt: skip
    write_op4({"K": model.K[order][:, order], "M": model.M[order][:, order]}, tmp_path / "a.op4")
    rows = [f"{k + 1}, {x!r}, {y!r}, {z!r}" for k, (x, y, z) in enumerate(model.points.tolist())]
    (tmp_path / "nodes.csv").write_text("\n".join(rows) + "\n")
    (tmp_path / "part.toml").write_text(
        '[matrices]\nstiffness = "a.op4:K"\nmass = "a.op4:M"\nnodes = "nodes.csv"\n'
        "[matrices.sets]\na = [1, 2]\nb = [11, 12]\n[interfaces]\n" + 'a = "rbe2"\nb = "rbe2"\n'
    )
    few, many = [], []
    for found, limit in ((few, component.MANY_FOR_SCIPY), (many, 1)):
        monkeypatch.setattr(component, "MANY_FOR_SCIPY", limit)
        part = rom.read_component(tmp_path / "part.toml")
        found += [part.model(), part.body()]
    assert few[0].operators is None and many[0].operators is not None
    assert_allclose(many[1].frequencies(8)[6:], few[1].frequencies(8)[6:], rtol=1e-8)
