"""A part that is open in the browser: what is clicked swings, strangers get no answer."""

import errno
import http.client
import json
import re
import subprocess
import sys
import threading
from math import pi

import pytest

import rom
from cases.files.browser import PROGRAM, REASON, WITH_WEBGL, browser
from cases.files.step_parts import step_plate
from cases.refusals import refuses
from rom.cli.verbs.open import Chosen
from rom.config.component import read_component
from rom.process import child
from rom.process.loopback import MAX_BYTES, Loopback

CHOICE = {"faces": {"bore": "face 7"}, "hinge": "bore", "E": "70", "nu": "0,33", "rho": "2700"}


@pytest.fixture
def page():
    """A server, what its page has asked for, and a way to ask as others would."""
    asked = []
    server = Loopback({"": b"the page"}.get, {"add": lambda options: asked.append(options) or 1})
    serving = threading.Thread(target=server.until_closed, daemon=True)
    serving.start()

    def ask(method, name="", body=None, **headers):
        connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=20)
        path = name if name.startswith("/") else f"/{server.token}/{name}"
        headers = {"Host": server.host, "Origin": f"http://{server.host}"} | headers
        connection.request(method, path, body, {k: v for k, v in headers.items() if v})
        return connection.getresponse()

    yield server, asked, ask, serving


def test_only_the_page_itself_gives_orders(page):
    server, asked, ask, _ = page
    assert ask("GET").read() == b"the page" and ask("POST", "add", '{"x": 1}').read() == b"1"
    for method, name, body, headers, code in (
        ("GET", "/", None, {}, 404),
        ("GET", "/guessed/", None, {}, 404),
        ("GET", "other", None, {}, 404),
        ("GET", "", None, {"Host": "evil.example"}, 404),
        ("POST", "add", "{}", {"Host": f"localhost.evil.example:{server.server_port}"}, 404),
        ("POST", "add", "{}", {"Origin": "http://evil.example"}, 404),
        ("POST", "add", "{}", {"Origin": ""}, 404),
        ("POST", "remove", "{}", {}, 404),
        ("POST", "add", "{", {}, 400),
        ("POST", "add", "[]", {}, 400),
        ("POST", "add", b" " * (MAX_BYTES + 1), {}, 413),
        ("POST", "add", iter([b"{}"]), {}, 413),  # of no length
    ):
        assert ask(method, name, body, **headers).status == code, (method, name, headers)
    assert asked == [{"x": 1}]


def test_news_go_to_one_page_and_the_server_ends_with_it(page):
    server, _, ask, serving = page
    server.tell(line="before")
    news = ask("GET", "events")
    assert json.loads(news.readline().removeprefix(b"data: ")) == {"line": "before"}
    assert ask("GET", "events").status == 409
    news.close()
    serving.join(10)
    assert not serving.is_alive()


@pytest.mark.parametrize("change, words", [
    ({"faces": {}}, "no face"), ({"faces": 1}, "no face"), ({"faces": {"": "face 7"}}, "a name"),
    ({"faces": {"bore": "face 8"}}, "'face 8'"), ({"faces": {"bore": ["face 7"]}}, "face"),
    ({"hinge": "pin"}, "hangs on"), ({"hinge": None}, "hangs on"), ({"E": "steel"}, "E = steel"),
    ({"nu": "0.6"}, "nu"), ({"rho": "-1"}, "rho"), ({"size": "nan"}, "size"), ({"E": None}, "E"),
])  # fmt: skip
def test_what_cannot_be_chosen_is_refused_and_nothing_written(tmp_path, change, words):
    faces = {"face 7": {"fixed": False}}
    chosen = Chosen(tmp_path / "part.step", {}, {}, faces, tmp_path / "out" / "part.toml", [])
    (tmp_path / "out").mkdir()
    refuses(rom.ConfigError, words, chosen.save, CHOICE | change)
    assert not chosen.file.exists()
    chosen.save(CHOICE)
    part = read_component(chosen.file)
    assert part.material() == rom.Material(70e9, 0.33, 2700.0)
    assert part.mesh[1]["faces"] == {"bore": "7"} and part.kinds.keys() == {"bore"}


def test_a_swing_that_cannot_be_started_is_told_and_holds_nothing_up(tmp_path, monkeypatch):
    def none(command):
        raise OSError(errno.EAGAIN, "no more processes")

    monkeypatch.setattr(child, "start", none)
    told, faces = [], {"face 7": {"fixed": False}}
    chosen = Chosen(tmp_path / "a.step", {}, {}, faces, tmp_path / "a.toml", [])
    chosen.tell = lambda **event: told.append(event)
    for _ in range(2):
        chosen.swing(CHOICE)
    failed = [event for event in told if event.get("failed")]
    assert len(failed) == 2 and all("no more processes" in event["ended"] for event in failed)


@pytest.mark.fenicsx
@pytest.mark.skipif(not PROGRAM, reason=REASON)
def test_a_face_that_is_clicked_is_what_the_part_hangs_on(tmp_path):
    """A plate, seen on its large side; nothing runs on when the page is left."""
    step_plate(tmp_path / "plate.step")
    command = [sys.executable, "-m", "rom", "open", "plate.step", "--no-browser", "-p", "lc=0.008"]
    server = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, stdout=subprocess.PIPE,
                              text=True, env=child.environment())  # fmt: skip
    address = re.search(r"http://\S+", server.stderr.readline())[0]
    progress = "document.querySelector('#progress').innerText"
    with browser(*WITH_WEBGL) as shown:
        shown.ask("Page.navigate", url=address)
        shown.until("document.querySelector('figure.scene.live') !== null")
        shown.click("figure.scene canvas")
        area = 100 * 60 - pi * (6**2 + 10**2)
        assert f"plane, {area:.4g} mm²" in shown.run("document.querySelector('#chosen').innerText")
        shown.run("document.querySelector('[name=name]').value = 'side'")
        shown.click("[name=swing]")
        shown.until("document.querySelector('#result iframe') !== null", 600)
        assert "rom swing plate_open/plate.toml --hinge side" in shown.run(progress)
        assert "held at side" in shown.run(progress) and not shown.complaints
        shown.click("[name=swing]")
        shown.until(f"{progress}.includes('dofs, ')")  # it has begun
    assert server.wait(20) == 0
    assert not subprocess.run(["pgrep", "-f", "rom swing plate_open"], capture_output=True).stdout
    assert server.stdout.read().split() == ["plate_open/plate.toml", "plate_open/plate/plate.html"]
    steel = rom.load(tmp_path / "plate_open/plate/plate.rom.npz")
    assert steel.mass == pytest.approx(7850 * 1e-9 * area * 10, rel=2e-3)
