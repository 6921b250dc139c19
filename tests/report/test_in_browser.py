"""Reports in a real browser: what a stranger sees who opens one, turns it and lets it move."""

import struct
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.files.browser import PROGRAM, REASON, WITH_WEBGL, WITHOUT_WEBGL, browser
from cases.files.reports import PIXEL, bar_that_bends
from cases.mbs.parts import ORIGIN, Z, on_hinge
from rom import report
from rom.view import box

pytestmark = [pytest.mark.once, pytest.mark.skipif(PROGRAM is None, reason=REASON)]

NAME = "</script><b>bar"
MODES, MOTION, TURN = "#modes", "#motion", "#turn"
LENGTH, QUARTER = 1.0, 0.1  # of the bar [m]; time of a quarter of a turn [s]
MAGNIFY = 2000.0  # of the cantilever, which sags by a few hundredths of a millimetre
SMALL = (640, 560)  # window [pixel]: the processor draws


def cantilever(body):
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    bar = mech.add_flexible("<b>bar", body)
    mech.fixed("wall", mech.ground.marker(body.marker("root").point), bar.marker("root"))
    return rom.simulate(mech, t_end=0.02, dt=1e-4)


def quarter_turn():
    """A box at +x that turns about z to +y."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    on_hinge(mech, ORIGIN, "arm", mass=1.0, inertia=(1e-2,) * 3, axis=Z)
    s = 2 * np.pi / QUARTER  # starts and ends without a jolt
    mech.drive("motor", "hinge", lambda t: (s * t - np.sin(s * t)) / 4)
    return rom.simulate(mech, t_end=QUARTER, dt=1e-3)


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    (folder / "still.png").write_bytes(PIXEL)
    body, side = replace(bar_that_bends(), name=NAME), {"view": (0, 0, 1), "up": (0, 1, 0)}
    bent = cantilever(body)
    shapes = {"arm": box((0.2, 0.1, 0.1), (1.0, 0.0, 0.0))}
    figures = {
        MODES: report.modes(body, folder / "still.png"),
        MOTION: report.motion(bent, folder / "still.png", magnify=MAGNIFY, **side),
        TURN: report.motion(quarter_turn(), shapes=shapes, **side),
    }
    blocks = [f"<div id='{name[1:]}'>{figure}</div>" for name, figure in figures.items()]
    path = report.write_report({NAME: blocks}, folder / "report.html", title=NAME)
    return path, bent


@pytest.fixture(scope="module")
def chromium():
    with browser(*WITH_WEBGL) as found:
        yield found


@pytest.fixture
def shown(chromium, page):
    chromium.open(page[0], SMALL)
    return chromium


def look(shown, figure):
    """(h, w) where a figure shows a body: opaque, and neither axes nor scale; and its colours."""
    shown.run(f"document.querySelector('{figure}').scrollIntoView()")
    shown.settle()
    pixels = shown.pixels(f"{figure} canvas")
    seen = pixels[..., 3] > 200
    seen[-85:, :100] = False
    seen[-50:, seen.shape[1] // 2 :] = False
    return seen, pixels


def middle(seen):
    """(2,) of what is seen, to the right and up from the lower left corner [pixel]."""
    y, x = np.nonzero(seen)
    return np.array([x.mean(), seen.shape[0] - y.mean()])


def lowest(bent):
    return bent.t[np.argmin(bent.position("<b>bar", "tip")[:, 1])] / bent.t[-1]


def text(shown, selector):
    return shown.run(f"document.querySelector('{selector}').textContent")


def differ(a, b):
    return int((np.abs(a - b).max(axis=-1) > 8).sum())


def test_it_opens_without_a_complaint_and_network_and_names_are_text(shown):
    for figure in (MODES, MOTION, TURN):
        assert look(shown, figure)[0].sum() > 500, figure
    assert not shown.complaints
    assert {url.partition(":")[0] for url in shown.requests} <= {"file", "data"}
    assert shown.run("document.querySelectorAll('figure.live').length") == 3
    for hidden in (".still", ".message"):
        assert shown.run(f"getComputedStyle(document.querySelector('{hidden}')).display") == "none"
    assert shown.run("document.querySelector('h1').textContent") == NAME
    assert shown.run("document.querySelectorAll('b').length") == 0
    assert NAME in text(shown, f"{MODES} figcaption")
    shown.set(f"{MOTION} .colour", "")
    assert text(shown, f"{MOTION} .legend") == "<b>bar"


def test_the_policy_keeps_other_scripts_and_the_network_out(shown):
    shown.run("""(() => { const one = document.createElement('script'); one.textContent = 'got = 1';
        document.body.append(one);
        const picture = new Image(); picture.src = 'http://127.0.0.1:9/x.png'; })()""")
    shown.settle()
    assert shown.run("typeof got") == "undefined"
    assert shown.run("fetch('http://127.0.0.1:9/').then(() => 1, () => 0)") == 0
    assert len([c for c in shown.complaints if "Content Security Policy" in str(c)]) >= 3


def test_play_moves_and_pause_stops(shown):
    for figure in (MODES, MOTION):
        _, before = look(shown, figure)
        shown.click(f"{figure} .play")
        shown.settle(4)
        _, during = look(shown, figure)
        assert differ(before, during) > 200
        shown.click(f"{figure} .play")
        _, after = look(shown, figure)
        shown.settle()
        assert differ(after, look(shown, figure)[1]) == 0
    assert "Play" in text(shown, f"{MOTION} .play")
    assert not shown.complaints


def test_modes_supports_and_coordinates_are_offered_and_without_amplitude_the_rest(shown):
    groups = shown.run(f"[...document.querySelectorAll('{MODES} optgroup')].map((x) => x.label)")
    assert groups == ["Free", "root held", "tip held", "Elastic coordinates"]
    seen = [look(shown, MODES)[1]]
    for number in ("1", "7"):
        shown.set(f"{MODES} .mode", number)
        seen.append(look(shown, MODES)[1])
    assert min(differ(seen[0], seen[1]), differ(seen[1], seen[2])) > 500
    shown.set(f"{MODES} .amplitude", "0")
    rest, _ = look(shown, MODES)
    shown.set(f"{MODES} .mode", "2")
    assert (look(shown, MODES)[0] != rest).sum() < 20
    shown.set(f"{MODES} .amplitude", "0.1")
    assert (look(shown, MODES)[0] != rest).sum() > 500


@pytest.mark.parametrize("k", [0, 1])
def test_the_stress_of_a_mode_is_that_at_the_displacement_said(shown, page, k):
    """Von Mises of xx and xy alone is sqrt(xx^2 + 3 xy^2)."""
    body = page[1].mechanism.parts["<b>bar"].flexible
    omega, V = body.modes()
    motion = V[:, np.flatnonzero(omega > 0)[k]]
    elastic = (body.surface.shape @ motion[6:]).reshape(-1, 3)
    moved = elastic + motion[:3] + np.cross(motion[3:6], body.surface.points)
    largest = np.linalg.norm(moved, axis=1).max()
    stress = 1e9 * np.sqrt(elastic[:, 1] ** 2 + 3 * elastic[:, 2] ** 2).max() * 0.01 / largest
    shown.set(f"{MODES} .mode", str(k))
    shown.set(f"{MODES} .colour", "stress")
    legend = f"document.querySelector('{MODES} .legend"
    words = shown.run(f"{legend} .meaning').textContent")
    assert words == "von Mises stress where the largest displacement is 10 mm [MPa]"
    end = shown.run(f"{legend} .ends').lastChild.textContent")
    assert float(end) == pytest.approx(1e-6 * stress, rel=6e-3)


def test_a_cantilever_bends_as_far_as_the_solution_says(shown, page):
    bent = page[1]
    share = lowest(bent)
    straight, _ = look(shown, MOTION)
    shown.set(f"{MOTION} .time", str(share))
    seen, _ = look(shown, MOTION)
    columns = np.flatnonzero(straight.any(axis=0))
    pixels = LENGTH / (columns[-1] - columns[0])  # [m]
    end = columns[-1] - 5

    def height(found):
        return found.shape[0] - np.flatnonzero(found[:, end]).mean()

    sag = bent.position("<b>bar", "tip")[:, 1]
    wanted = MAGNIFY * (sag - sag[0]).min()
    assert wanted < -0.05
    assert_allclose((height(seen) - height(straight)) * pixels, wanted, rtol=0.06)
    shown.set(f"{MOTION} .amplitude", "0")
    assert (look(shown, MOTION)[0] != straight).sum() < 500


def test_a_body_turns_the_way_of_the_solution(shown):
    places = []
    for share in ("0", "0.5", "1"):
        shown.set(f"{TURN} .time", share)
        places.append(middle(look(shown, TURN)[0]))
    first, half, last = places
    radius = (first - last)[0]
    hub = np.array([last[0], first[1]])
    assert radius > 100
    assert_allclose(last - hub, [0, radius], atol=0.03 * radius)
    assert_allclose(half - hub, radius * np.sqrt([0.5, 0.5]), atol=0.03 * radius)


def test_colours_follow_the_deformation_and_the_legend_has_units(shown, page):
    """The made-up stress is 1 GPa per metre along y: the tip of the cantilever has the most."""
    shown.set(f"{MOTION} .time", str(lowest(page[1])))
    for kind, unit in (("displacement", "µm]"), ("stress", "kPa]")):
        shown.set(f"{MOTION} .colour", kind)
        seen, pixels = look(shown, MOTION)
        columns = np.flatnonzero(seen.any(axis=0))
        root, tip = (pixels[:, k][seen[:, k]].mean(axis=0) for k in (columns[8], columns[-8]))
        assert root[2] > root[1] and tip[1] > 1.5 * tip[2], kind  # violet to yellow
        words = text(shown, f"{MOTION} .legend")
        assert unit in words, words
    bent = page[1]
    surface = bent.mechanism.parts["<b>bar"].flexible.surface
    far = np.abs((bent.elastic("<b>bar") @ surface.shape.T)[:, 1::3]).max()
    assert words.endswith(f"{1e6 * far:.3g}")
    shown.set(f"{MOTION} .colour", "")
    seen, pixels = look(shown, MOTION)
    assert np.ptp(pixels[seen][:, 0]) < 150 and (pixels[seen].mean(axis=0)[0] < 100)


def test_it_turns_and_zooms_by_mouse_and_keys_and_comes_back(shown):
    _, before = look(shown, MODES)
    x, y = shown.middle(f"{MODES} canvas")
    shown.mouse((x, y), (x + 120, y + 40))
    shown.settle()
    _, turned = look(shown, MODES)
    assert differ(before, turned) > 500
    shown.click(f"{MODES} .reset")
    assert differ(before, look(shown, MODES)[1]) < 50
    shown.run(f"document.querySelector('{MODES} canvas').focus()")
    area = look(shown, MODES)[0].sum()
    shown.key("+")
    assert look(shown, MODES)[0].sum() > 1.1 * area
    shown.key("ArrowLeft")
    _, left = look(shown, MODES)
    assert differ(before, left) > 500
    shown.key("0")
    assert differ(before, look(shown, MODES)[1]) < 50
    shown.key(".")
    assert shown.run(f"document.querySelector('{MODES} .mode').value") == "1"
    shown.key(" ")
    assert "Pause" in text(shown, f"{MODES} .play")


def test_the_scale_is_true(shown):
    seen, pixels = look(shown, MOTION)
    columns = np.flatnonzero(seen.any(axis=0))
    rule = np.flatnonzero(pixels[-20, :, 3] > 100)
    rule = rule[rule > pixels.shape[1] / 2]
    assert_allclose((rule[-1] - rule[0]) / (columns[-1] - columns[0]), 0.2, rtol=0.02)


@pytest.mark.parametrize("dark", [False, True])
def test_it_fits_a_phone_in_the_light_and_in_the_dark(chromium, page, dark):
    chromium.open(page[0], size=(400, 800), dark=dark)
    assert chromium.run("document.documentElement.scrollWidth") <= 400
    assert look(chromium, MODES)[0].sum() > 1000
    ink, paper = (
        chromium.run(f"getComputedStyle(document.body).{what}.match(/[0-9]+/g).map(Number)")
        for what in ("color", "backgroundColor")
    )
    assert (np.mean(ink) > np.mean(paper)) == dark and abs(np.mean(ink) - np.mean(paper)) > 150
    assert not chromium.complaints


def test_print_has_the_still_picture(shown):
    shown.ask("Emulation.setEmulatedMedia", media="print")

    def display(selector):
        return shown.run(f"getComputedStyle(document.querySelector('{selector}')).display")

    assert display(f"{MODES} .still") != "none"
    assert display(f"{MODES} .stage") == display(f"{MODES} .controls") == "none"
    assert display(f"{TURN} .stage") != "none"  # it has no other picture
    shown.ask("Emulation.setEmulatedMedia", media="")


def test_without_webgl_the_still_picture_stays_and_says_why(page):
    with browser(*WITHOUT_WEBGL) as found:
        found.open(page[0], SMALL)
        assert not found.complaints
        assert found.run("document.querySelectorAll('figure.live').length") == 0
        words = found.run(f"document.querySelector('{MODES} .message').innerText")
        assert "still picture" in words and "WebGL" in words
        width = found.run(f"document.querySelector('{MODES} .still img').naturalWidth")
        assert width == struct.unpack(">I", PIXEL[16:20])[0]
        assert found.run("document.querySelectorAll('button').length") == 0
