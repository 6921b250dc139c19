"""What a page draws is the body, its modes and its motion, to the last pixel."""

import base64
import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse.linalg import spsolve

import rom
from cases.files.reports import bar_that_bends
from cases.long import few
from cases.mbs.drawn import volume
from cases.refusals import refuses
from cases.solid import block
from rom import report
from rom.report import coarse, scene
from rom.report.scene import read_scene, write_scene
from rom.view.canvas.scene import sharp_edges
from rom.view.canvas.solids import ellipsoid

SUPPORTS = ("root held", "tip held")


@pytest.fixture(scope="module")
def body():
    return bar_that_bends()


@pytest.fixture(scope="module")
def solution(body):
    """The bar as a cantilever that gravity bends, and a ball that falls beside it."""
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    bar = mech.add_flexible("bar", body)
    mech.add_rigid("ball", mass=1.0, inertia=(1e-3,) * 3, at=(0.5, 0.0, 0.5))
    place = mech.design_point(bar.marker("root"))
    mech.fixed("wall", mech.ground.marker(place), bar.marker("root"))
    return rom.simulate(mech, t_end=0.02, dt=1e-4)


def numbers(array):
    return np.frombuffer(base64.b64decode(array["data"]), coarse.TYPES[array["type"]]).astype(float)


def points(body):
    it = body["points"]
    return np.array(it["centre"]) + it["step"] * numbers(it["values"]).reshape(-1, 3)


def columns(listed):
    return np.stack([one["scale"] * numbers(one["values"]) for one in listed], axis=1)


def test_the_page_gets_the_surface_to_16_bit_and_the_modes_of_the_report(body):
    (sent,) = scene.modes_scene(body)["bodies"]
    size = np.ptp(body.surface.points, axis=0).max()
    assert np.abs(points(sent) - body.surface.points).max() < 1e-5 * size
    shapes = columns(sent["shapes"])
    largest = np.abs(body.surface.shape).max(axis=0)
    assert (np.abs(shapes - body.surface.shape).max(axis=0) <= 0.6 * largest / 32767).all()
    assert_allclose(columns(sent["stresses"])[0::6], 1e9 * shapes[1::3], atol=1e-4 * 1e9)
    assert (numbers(sent["triangles"]).reshape(-1, 3) == body.surface.triangles).all()
    modes = scene.modes_scene(body)["modes"]
    compared = body.provenance["comparison"]
    for support, group in [("free", "Free"), *zip(SUPPORTS, SUPPORTS, strict=True)]:
        labels = [mode["label"] for mode in modes if mode["group"] == group]
        reduced = compared[support]["reduced"]
        assert labels == [f"{support}, mode {k + 1}: {f:.5g} Hz" for k, f in enumerate(reduced)]
    single = [mode for mode in modes if mode["group"] == "Elastic coordinates"]
    assert [mode["coordinate"] for mode in single] == list(range(body.n_modes))


def test_a_held_end_does_not_move_and_a_free_bar_bends_about_its_nodes(body):
    """First bending of a free-free beam: nodes at 0.2242 of its length (Blevins 1979)."""
    found = scene.modes_scene(body)
    (sent,) = found["bodies"]
    X, S = points(sent), columns(sent["shapes"])

    def moved(mode):
        a, theta = np.array(mode["rigid"][:3]), np.array(mode["rigid"][3:])
        return a + np.cross(theta, X) + (S @ mode["q"]).reshape(-1, 3)

    held = next(m for m in found["modes"] if m["group"] == "root held")
    assert np.abs(moved(held)[X[:, 0] == X[:, 0].min()]).max() < 1e-3
    assert_allclose(np.abs(moved(held)).max(), 1.0, rtol=1e-3)
    free = moved(found["modes"][0])
    across = np.argmax(np.abs(free).max(axis=0))
    line = [free[np.abs(X[:, 0] - x) < 1e-3, across].mean() for x in np.linspace(0, 1, 9)]
    k = next(k for k in range(8) if line[k] * line[k + 1] < 0)
    node = (k + line[k] / (line[k] - line[k + 1])) / 8
    assert abs(node - 0.2242) < 0.02


def test_a_motion_is_that_of_the_solution(solution, body):
    found = scene.motion_scene(solution, magnify=7.0)
    bar, ball = found["bodies"]
    t = numbers(found["times"])
    assert_allclose(t, solution.t, atol=1e-8)  # fewer instants than are kept
    fall = numbers(ball["position"]).reshape(-1, 3)[:, 1]
    assert_allclose(fall - fall[0], -9.81 * t**2 / 2, atol=1e-6)
    assert_allclose(numbers(ball["orientation"]).reshape(-1, 4), [[1, 0, 0, 0]] * len(t))
    X = points(bar)
    end = np.isclose(X[:, 0], 1.0, atol=1e-4)
    tip = (numbers(bar["q"]).reshape(len(t), -1) @ columns(bar["shapes"]).T).reshape(len(t), -1, 3)
    sag = solution.position("bar", "tip")[:, 1]
    assert_allclose(tip[:, end, 1].mean(axis=1), sag - sag[0], atol=1e-3 * np.ptp(sag))
    assert found["magnify"] == 7.0
    # a cantilever that is let go swings twice as far as the full model sags at rest
    assert_allclose(found["limits"]["displacement"], 2 * sag_at_rest(), rtol=0.05)
    far = np.abs(tip[..., 1]).max()
    assert_allclose(found["limits"]["stress"], 1e9 * far, rtol=1e-3)


def sag_at_rest():
    """Largest displacement of the full model under its weight, its root held [m]."""
    model = block(cells=(8, 2, 2))
    free = np.setdiff1d(np.arange(model.K.shape[0]), model.interfaces["root"].dofs)
    weight = model.M @ np.tile([0.0, -9.81, 0.0], len(model.points))
    return np.abs(spsolve(model.K[free][:, free].tocsc(), weight[free])).max()


def test_the_page_gets_what_can_be_seen_and_nothing_else(solution, monkeypatch):
    long = rom.simulate(solution.mechanism, t_end=0.5, dt=1e-4)
    found = scene.motion_scene(long)
    t = numbers(found["times"])
    assert len(t) == scene.N_FRAMES and t[-1] == pytest.approx(0.5)
    assert np.diff(t).max() < 1.2 * 0.5 / len(t)
    bar, _ = scene.motion_scene(solution)["bodies"]
    part = solution.mechanism.parts["bar"]
    q, shapes = np.abs(solution.elastic("bar")), np.abs(part.flexible.surface.shape)
    reach = q.max(axis=0) * shapes.max(axis=0)
    assert 0 < len(bar["shapes"]) < part.r
    assert len(bar["shapes"]) >= (reach > 1e-3 * reach.max()).sum()


def sphere(n):
    """A closed surface of 2 n (n - 1) + 2 points on the unit sphere."""
    return ellipsoid((1.0, 1.0, 1.0), sides=2 * n)


@pytest.mark.parametrize("n_max", few(1, [300, 1500]))
def test_a_coarser_surface_keeps_points_and_shape(n_max):
    X, triangles = sphere(60)
    kept, found = coarse.coarsened(X, triangles, n_max)
    assert n_max / 3 < len(kept) <= n_max
    assert len(set(kept)) == len(kept) and found.max() == len(kept) - 1
    assert all(len(set(corner)) == 3 for corner in found.tolist())
    assert_allclose(volume((X[kept], found)), 4 / 3 * np.pi, rtol=9 / n_max)


@pytest.mark.parametrize("n_max", [150, 400])
def test_a_coarser_block_keeps_its_edges_its_corners_and_points_to_bend_by(n_max):
    """The twelve edges of a block: no others, and as long as before; its volume to round-off."""
    model = block(size=(1.0, 0.3, 0.2), cells=(30, 9, 6))
    X = model.points[model.surface.nodes] - (0.5, 0.15, 0.1)
    triangles = model.surface.triangles.copy()
    a, b, c = np.moveaxis(X[triangles], 1, 0)
    inward = np.einsum("ij,ij->i", a, np.cross(b, c)) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    kept, found = coarse.coarsened(X, triangles, n_max)
    assert n_max / 2 < len(kept) <= n_max
    assert_allclose(volume((X[kept], found)), 1.0 * 0.3 * 0.2, rtol=1e-12)
    ends = X[kept][sharp_edges(X[kept], found)]
    assert_allclose(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum(), 4 * 1.5, rtol=1e-12)
    spans = X[kept][found][:, [1, 2, 0]] - X[kept][found]
    assert np.linalg.norm(spans, axis=2).max() < 0.35


def test_a_surface_with_ends_becomes_coarser_too_and_a_small_one_stays():
    X, triangles = sphere(60)
    open_ = triangles[X[triangles].mean(axis=1)[:, 2] > 0]
    kept, found = coarse.coarsened(X, open_, 200)
    assert 60 < len(kept) <= 200 and found.max() == len(kept) - 1
    X, triangles = sphere(6)
    kept, found = coarse.coarsened(np.vstack([X, [[9.0, 9.0, 9.0]]]), triangles, 1000)
    assert (kept == np.arange(len(X))).all() and (found == triangles).all()


@pytest.mark.long
def test_a_fine_surface_takes_no_more_than_its_share_of_the_page(body):
    (sent,) = scene.modes_scene(body, size=6 * 3 * body.n_modes * scene.MIN_POINTS)["bodies"]
    assert len(points(sent)) <= scene.MIN_POINTS
    X, triangles = sphere(60)
    fine = replace(body.surface, points=X, triangles=triangles,
                   shape=np.ones((3 * len(X), body.n_modes)))  # fmt: skip
    (sent,) = scene.modes_scene(replace(body, surface=fine, stress=None), size=10**5)["bodies"]
    assert len(points(sent)) <= max(10**5 / (6 * body.n_modes), scene.MIN_POINTS)
    assert columns(sent["shapes"]).shape == (3 * len(points(sent)), body.n_modes)


def test_what_cannot_be_drawn_is_refused(body, solution):
    for words, draw in {
        "'bar' carries no surface": lambda: report.modes(replace(body, surface=None, stress=None)),
        "shapes: no body 'wheel'": lambda: report.motion(solution, shapes={"wheel": sphere(4)}),
        "must be a picture of the kinds": lambda: report.motion(solution, "none.png"),
        "are no two directions": lambda: report.motion(solution, view=(0, 1, 0), up=(0, 1, 0)),
    }.items():
        refuses(rom.ConfigError, words, draw)


def test_a_scene_of_a_run_comes_back(solution, tmp_path):
    found = scene.motion_scene(solution, title="Motion of <b>")
    write_scene(found, tmp_path / "scene.json")
    assert read_scene(tmp_path / "scene.json") == found


def first(**more):
    return lambda s: s["bodies"][0].update(**more)


DAMAGE = {  # what is wrong: (how it is made wrong, words of the message)
    "another schema": (lambda s: s.update(schema="x"), "version"),
    "a later version": (lambda s: s.update(version=[2, 0]), r"version \[2, 0\] is not known"),
    "no bodies": (lambda s: s.update(bodies=[]), "no bodies"),
    "modes": (lambda s: s.update(modes=[{}]), "no bodies that move"),
    "no times": (lambda s: s.pop("times"), "'times'"),
    "fewer instants": (lambda s: s.update(times=coarse.array([0, 1], "float32")), "do not fit"),
    "not a number": (first(q=coarse.array(np.full(402, np.nan), "float32")), "not finite"),
    "a view of infinity": (lambda s: s["view"].update(radius=1e999), "not finite"),
    "a corner too many": (first(triangles=coarse.array([0, 1, 60000], "uint16")), "not there"),
    "a cut array": (lambda s: s["bodies"][1]["position"].update(data="AAA"), "padding"),
    "another type": (lambda s: s["bodies"][1]["position"].update(type="object"), "'object'"),
    "a name that is none": (first(name=3), "no name"),
}


@pytest.mark.parametrize("case", DAMAGE)
def test_a_damaged_scene_is_refused(case, solution, tmp_path):
    spoil, words = DAMAGE[case]
    found = json.loads(json.dumps(scene.motion_scene(solution)))
    spoil(found)
    (tmp_path / "scene.json").write_text(json.dumps(found))
    refuses(rom.FileFormatError, words, read_scene, tmp_path / "scene.json")


@pytest.mark.parametrize("text", ["", "[]", "{}", "[" * 10**5, '{"schema": "rom-scene"'])
def test_what_is_no_scene_is_refused(text, tmp_path):
    (tmp_path / "scene.json").write_text(text)
    refuses(rom.FileFormatError, "no scene of a run", read_scene, tmp_path / "scene.json")
