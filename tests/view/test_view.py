"""Pictures show what they should: read back pixel by pixel."""

import sys
from dataclasses import replace

import numpy as np
import pytest

from cases.refusals import refuses

pytest.importorskip("pyvista", reason="pictures need pyvista")
pytest.importorskip("matplotlib", reason="pictures need matplotlib")

from PIL import Image

import rom
from cases.command import ran
from cases.mbs.drawn import lattice_bar, squeezed, swinging
from rom import view
from rom.components import cosserat
from rom.errors import ConfigError, InterfaceError
from rom.model import FEModel, Interface, SurfaceMesh
from rom.view.canvas.offscreen import render
from rom.view.canvas.scene import Actor, Camera, aimed, sharp_edges
from rom.view.figures.curves import _apart
from rom.view.scenes.film import Look, _stage, _words

BLUE, RED = (0x2F, 0x7F, 0x9F), (0xD1, 0x49, 0x5B)


def pixels(path, frame=0):
    picture = Image.open(path)
    picture.seek(frame)
    return np.asarray(picture.convert("RGB")).astype(int)


def seen(**directions):
    return aimed(np.eye(3), 100, **directions)


def colourful(image):
    return np.ptp(image, axis=2) > 60


@pytest.fixture(scope="module")
def bar():
    return lattice_bar()


def test_a_scene_is_drawn_to_scale_and_a_box_has_twelve_edges():
    """A unit square at the upper right of a 4 by 2 window, seen along z."""
    square = np.array([[1.0, 0, 0], [2, 0, 0], [2, 1, 0], [1, 1, 0]])
    actor = Actor(square[None], np.array([[0, 1, 2], [0, 2, 3]]), colour="#ff0000")
    camera = Camera(np.zeros(3), np.array([0, 0, 1.0]), np.array([0, 1.0, 0]), 2.0, (400, 200))
    image = render([actor], camera)[0].astype(int)
    rows, columns = np.nonzero(image[..., 0] - image[..., 1] > 80)
    assert image.shape == (200, 400, 3)
    np.testing.assert_allclose([rows.min(), rows.max() + 1], [0, 100], atol=2)
    np.testing.assert_allclose([columns.min(), columns.max() + 1], [300, 400], atol=2)
    points, triangles = view.box((1, 2, 3))
    edges = sharp_edges(points, triangles)
    lengths = np.sort(np.linalg.norm(np.diff(points[edges], axis=1)[:, 0], axis=1))
    np.testing.assert_allclose(lengths, [1] * 4 + [2] * 4 + [3] * 4)


def test_a_plane_body_is_drawn_beside_its_curves_and_its_film_keeps_frame_and_colours(tmp_path):
    more = {"limit": ("exact", 1.0), "xlabel": "size", "ylabel": "answer", "title": "t"}
    curves = {"coarse": ([1, 2, 4], [0.2, 0.7, 0.9])}
    path = view.deformed(curves, [squeezed(0.5)], tmp_path / "s.png", caption="words", **more)
    image = pixels(path)
    yellow = (image[..., 0] > 240) & (image[..., 1] > 220) & (image[..., 2] < 60)
    rows, columns = np.nonzero(yellow[:550])
    assert np.ptp(rows) == pytest.approx(3 * np.ptp(columns), rel=0.05)  # 1.5 high, 0.5 wide
    refuses(ConfigError, "4 shapes", view.deformed, curves, [squeezed(0.1)] * 4, **more)
    shapes = [squeezed(a) for a in (0.0, 0.25, 0.5)]
    path = view.flow(np.array([0.0, 1e-6, 2e-6]), shapes, tmp_path / "s.gif", caption="words")
    sizes = [int(colourful(pixels(path, frame)[:740]).sum()) for frame in range(3)]
    assert sizes[0] > sizes[1] > sizes[2]  # the area is 1 - amount^2
    assert sizes[2] == pytest.approx(0.75 * sizes[0], rel=0.1)
    refuses(ConfigError, "2 times for 3", view.flow, np.zeros(2), shapes)


@pytest.mark.long
def test_the_colours_of_a_mesh_are_those_of_its_interfaces(tmp_path):
    points, triangles = view.box((2, 1, 1))
    right = np.flatnonzero(points[:, 0] > 0)
    face = Interface("tip", right, points[right], None, points[right].mean(axis=0))
    model = FEModel(None, None, points, {"tip": face}, surface=SurfaceMesh(np.arange(8), triangles))
    shares = []
    for side in (1, -1):
        red = pixels(view.mesh(model, tmp_path / "box.png", view=(side, 0.2, 0.3), up=(0, 0, 1)))
        shares.append(((red[..., 0] - red[..., 1]) > 80).mean())
    assert shares[0] > 0.1 and shares[1] < 0.01


@pytest.mark.long
def test_a_film_moves_and_loops(bar, tmp_path):
    mech, sol = swinging(bar)
    view.animate(mech, sol, tmp_path / "film.gif", frames=5, seconds=1.0, magnify=10.0)
    film = Image.open(tmp_path / "film.gif")
    assert (film.n_frames, film.info["duration"], film.info["loop"]) == (5, 200, 0)
    masks = [colourful(pixels(tmp_path / "film.gif", k)) for k in range(5)]
    assert masks[4].mean() > 0.01
    assert (masks[0] != masks[2]).mean() > 0.01


def test_bodies_are_drawn_where_they_are(bar):
    mech, sol = swinging(bar)
    look = Look({"ball": view.box((0.1, 0.1, 0.1))})
    stage = _stage(mech, sol, np.array([0, 40, 100]), look)
    wanted = sol.position("bar", "n7")[[0, 40, 100]]
    np.testing.assert_allclose(stage.actors[0].points[:, 7], wanted, atol=1e-12)
    centre = stage.actors[2].points.mean(axis=1)
    np.testing.assert_allclose(centre, sol.position("ball")[[0, 40, 100]], atol=1e-12)
    u = sol.elastic("bar")[[0, 40, 100]] @ bar.markers["n7"].translation.T
    scale = {"m": 1.0, "mm": 1e3, "µm": 1e6, "nm": 1e9}[stage.unit]
    size = scale * np.linalg.norm(u, axis=1)
    np.testing.assert_allclose(stage.actors[0].values[:, 7], size, atol=1e-9 * size.max())


def test_rods_are_grey_and_not_called_rigid(bar):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_flexible("bar", bar)
    section = {"stretch": (5e5, 5e5, 1e6), "bend": (1e3,) * 3, "mass": 1.0, "inertia": (1e-2,) * 3}
    for grey in ("rigid bodies.", "rigid bodies and rods."):
        stage = _stage(mech, rom.simulate(mech, t_end=1e-4, dt=1e-4), np.array([0]), Look({}))
        assert _words(stage, 1.0).endswith(f"; grey are {grey}")
        mech.add_nonlinear(f"beside {grey}", cosserat.body(cosserat.straight(1.0, 1, **section)))


def test_wrong_requests_are_refused(bar, tmp_path):
    mech, sol = swinging(bar)
    wrong, film, picture = {"boll": view.box((1, 1, 1))}, tmp_path / "a.gif", tmp_path / "a.png"
    long, short = [("x", {"one": [1, 2, 3]})], [("error", {"x": ([1, 2], [1.0])})]
    odd = [("y", {"seen": ([0.0, 0.5, 1.0], [1.0, 2.0])})]
    panel = view.Panel("", "", curves={"one": ([1, 2], [1])})
    for words, draw in {
        "ending '.jpg'": lambda: view.mode_shapes(bar, tmp_path / "modes.jpg"),
        "does not exist": lambda: view.animate(mech, sol, tmp_path / "nowhere" / "film.gif"),
        "no body 'boll'": lambda: view.animate(mech, sol, film, shapes=wrong),
        "no surface": lambda: view.mode_shapes(replace(bar, surface=None), picture),
        "no interface 'tip'": lambda: view.mode_shapes(bar, picture, fixed=("tip",)),
        "no two directions": lambda: view.mode_shapes(bar, picture, view=(0, 0, 1), up=(0, 0, 2)),
        "3 values of 'one' for 2 times": lambda: view.history([0, 1], long, picture),
        "2 values of 'seen' for 3 times": lambda: view.history([0, 1], odd, picture),
        "1 values of 'one' for 2 places": lambda: view.panels([[panel]], picture),
        "1 errors of 'x' for 2 sizes": lambda: view.convergence(short, picture, xlabel="modes"),
        r"view has shape \(2,\), needed is \(3,\).*three numbers": lambda: seen(view=(0, 1)),
        "up = .*nan.* is not finite": lambda: seen(up=(0, np.nan, 1)),
        r"view = \(0, 0, 0\) and up = None are no two.*not zero": lambda: seen(view=(0, 0, 0)),
    }.items():
        kind = InterfaceError if "interface" in words else ConfigError
        refuses(kind, f"(?s){words}", draw)
    assert not list(tmp_path.iterdir())


def test_vtk_stays_in_the_process_that_draws_and_says_so_if_it_cannot(bar, tmp_path, monkeypatch):
    """VTK and dolfinx in one process may abort."""
    script = (
        "import sys, numpy as np; from rom.view.canvas.offscreen import render; "
        "from rom.view.canvas.scene import Actor, Camera; "
        "camera = Camera(np.zeros(3), np.eye(3)[2], np.eye(3)[1], 2.0, (40, 20)); "
        "actor = Actor(np.eye(3)[None], np.array([[0, 1, 2]])); "
        "assert render([actor], camera).shape == (1, 20, 40, 3); "
        "assert not {'vtkmodules', 'pyvista', 'dolfinx'} & set(sys.modules)"
    )
    done = ran(sys.executable, "-c", script)
    assert done.returncode == 0, done.stderr
    script = "import sys, rom.view.canvas.draw, pyvista; assert 'dolfinx' not in sys.modules"
    assert ran(sys.executable, "-c", script).returncode == 0
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "executable", "/bin/false")
    refuses(ConfigError, "ended with code 1", view.mode_shapes, bar, tmp_path / "modes.png", n=1)


def test_ticks_too_close_for_words_have_none():
    sizes = [12, 18, 24, 30, 36, 60, 90, 96, 99, 126, 1482]
    assert _apart(sizes, 1500 / 11) == [f"{x}" * (x not in (96, 99)) for x in sizes]


def test_a_plane_shows_values_outlines_and_the_first_index_along_x(tmp_path):
    shade = np.broadcast_to(np.linspace(0, 1, 40)[:, None], (40, 30))
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    drawings = [
        view.Drawing("map", "x [m]", "y [m]", (0.0, 4.0, 0.0, 3.0), shade, "height [m]"),
        view.Drawing("stone", "x [m]", "y [m]", polygons=[square], curves={"line": [square]}),
    ]
    path = view.plane(drawings, tmp_path / "plane.png", title="T", caption="C " * 20)
    image = pixels(path)
    row = image[110 + 240, 120:560]
    hue = row[colourful(row[None])[0]].sum(axis=1)
    assert hue.size > 300 and hue[-20:].mean() > 2 * hue[:20].mean()
    assert (image[:, 700:] == (0xD9, 0xD2, 0xC3)).all(axis=2).sum() > 20000
    refuses(ConfigError, "nothing to draw", view.plane, [])


def test_a_campbell_diagram_shows_modes_multiples_and_where_they_meet(tmp_path):
    speeds = np.linspace(0.0, 100.0, 11)
    modes = np.array([-2.0 + 60j + 0.1j * speeds, -1.0 + 90j - 0.1j * speeds]).T
    diagram = rom.mbs.Campbell(speeds, modes, np.ones((10, 2)))
    words = {"title": "Rotor", "caption": "Two modes."}
    file = view.campbell(diagram, tmp_path / "c.png", orders=(1, 2), names=("up", "down"), **words)
    image = pixels(file)
    for colour in (BLUE, RED):  # in both panels
        rows = np.flatnonzero((np.abs(image - colour).max(axis=2) < 8).any(axis=1))
        assert np.ptp(rows) > 330
    undamped = rom.mbs.Campbell(speeds, 1j * modes.imag, np.ones((10, 2)))
    alone = pixels(view.campbell(undamped, tmp_path / "alone.png", **words))
    assert alone.shape[0] < image.shape[0] - 300
    refuses(ConfigError, "1 names for 2 modes", view.campbell, diagram, names=("up",))
