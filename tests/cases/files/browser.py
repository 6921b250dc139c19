"""A browser without a screen, spoken to through two pipes in its own protocol (CDP)."""

import base64
import json
import os
import select
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager

import numpy as np

PROGRAM = shutil.which("chromium") or shutil.which("chromium-browser")
REASON = "needs chromium (apt install chromium)"
TIME_LIMIT = 60.0  # of one answer [s]
OPTIONS = (
    "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
    "--disable-dev-shm-usage", "--hide-scrollbars", "--force-device-scale-factor=1",
    "--remote-debugging-pipe",
)  # fmt: skip
WITH_WEBGL = ("--use-angle=swiftshader", "--enable-unsafe-swiftshader")
WITHOUT_WEBGL = ("--disable-3d-apis",)
# the browser reads from 3 and writes to 4, whatever numbers these pipes had
LAUNCHER = (
    "import fcntl, os, sys; "
    "r, w = (fcntl.fcntl(int(end), fcntl.F_DUPFD, 10) for end in sys.argv[1:3]); "
    "os.dup2(r, 3); os.dup2(w, 4); os.execvp(sys.argv[3], sys.argv[3:])"
)


class Browser:
    """One page of a browser; its complaints and the addresses that it asks for are kept."""

    def __init__(self, pipe_out, pipe_in):
        self.out, self.inward, self.buffer = pipe_out, pipe_in, b""
        self.number, self.session = 0, None
        self.complaints, self.requests = [], []
        target = self.ask("Target.createTarget", url="about:blank")["targetId"]
        attached = self.ask("Target.attachToTarget", targetId=target, flatten=True)
        self.session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.ask(f"{domain}.enable")

    def ask(self, method, **parameters):
        """The answer to one message; what happens meanwhile is noted."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        os.write(self.out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self.number:
                assert "error" not in answer, (method, answer)
                return answer["result"]
            self._note(answer)

    def _next(self):
        end = time.monotonic() + TIME_LIMIT
        while b"\0" not in self.buffer:
            ready, _, _ = select.select([self.inward], [], [], max(end - time.monotonic(), 0))
            assert ready, f"the browser says nothing for {TIME_LIMIT} s"
            more = os.read(self.inward, 1 << 20)
            assert more, "the browser has ended"
            self.buffer += more
        message, _, self.buffer = self.buffer.partition(b"\0")
        return json.loads(message)

    def _note(self, event):
        method, found = event.get("method"), event.get("params", {})
        if method == "Runtime.consoleAPICalled" and found["type"] == "error":
            self.complaints.append([str(a.get("value", a)) for a in found["args"]])
        elif method == "Runtime.exceptionThrown":
            self.complaints.append(found["exceptionDetails"])
        elif method == "Log.entryAdded" and found["entry"]["level"] == "error":
            self.complaints.append(found["entry"]["text"])
        elif method == "Network.requestWillBeSent":
            self.requests.append(found["request"]["url"])

    def open(self, path, size=(1280, 900), dark=False):
        """Show a file, and wait until it stands."""
        self.complaints.clear()
        self.requests.clear()
        self.window(size)
        theme = [{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}]
        self.ask("Emulation.setEmulatedMedia", features=theme)
        self.ask("Page.navigate", url=path.resolve().as_uri())
        self.until("document.readyState === 'complete' && location.protocol === 'file:'")
        self.settle()

    def window(self, size):
        self.ask("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1],
                 deviceScaleFactor=1, mobile=False)  # fmt: skip

    def run(self, script):
        """Value of an expression in the page; promises are waited for."""
        found = self.ask(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in found, found["exceptionDetails"]
        return found["result"].get("value")

    def until(self, condition, seconds=TIME_LIMIT):
        """Wait for what the page says itself."""
        end = time.monotonic() + seconds
        while not self.run(condition):
            assert time.monotonic() < end, condition

    def settle(self, frames=3):
        """Wait until the page has been drawn so often."""
        self.run(
            "new Promise((done) => { const next = (k) => k ? requestAnimationFrame(() => "
            f"next(k - 1)) : done(true); next({frames}); }})"
        )

    def click(self, selector):
        """A real click of the mouse in the middle of an element."""
        self.run(f"document.querySelector({selector!r}).scrollIntoView({{block: 'center'}})")
        self.settle()
        self.mouse(self.middle(selector))
        self.settle()

    def middle(self, selector):
        return self.run(
            f"(() => {{ const r = document.querySelector({selector!r}).getBoundingClientRect(); "
            "return [r.x + r.width / 2, r.y + r.height / 2]; })()"
        )

    def mouse(self, at, to=None):
        """Press the mouse at one place, and leave it there or at another."""
        press = {"button": "left", "buttons": 1, "clickCount": 1}
        self.ask("Input.dispatchMouseEvent", type="mousePressed", x=at[0], y=at[1], **press)
        if to is not None:
            for share in (0.5, 1.0):
                x, y = (a + share * (b - a) for a, b in zip(at, to, strict=True))
                self.ask("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y, **press)
        x, y = to or at
        self.ask("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, **press)

    def key(self, key):
        text = {"text": key} if len(key) == 1 else {}
        self.ask("Input.dispatchKeyEvent", type="keyDown", key=key, **text)
        self.ask("Input.dispatchKeyEvent", type="keyUp", key=key)
        self.settle()

    def set(self, selector, value):
        """Give a slider or a choice a value, as a hand does."""
        self.run(
            f"(() => {{ const one = document.querySelector({selector!r}); one.value = {value!r}; "
            "one.dispatchEvent(new Event('input')); one.dispatchEvent(new Event('change')); })()"
        )
        self.settle()

    def pixels(self, selector="canvas"):
        """(h, w, 4) what a canvas shows, as integers."""
        width, height, code = self.run(
            f"(() => {{ const c = document.querySelector({selector!r});"
            "const data = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
            "let text = ''; for (let k = 0; k < data.length; k += 8192)"
            "text += String.fromCharCode(...data.subarray(k, k + 8192));"
            "return [c.width, c.height, btoa(text)]; })()"
        )
        data = np.frombuffer(base64.b64decode(code), dtype=np.uint8)
        return data.reshape(height, width, 4).astype(int)


@contextmanager
def browser(*options):
    """A browser that is started, and ended whatever happens."""
    read_end, out = os.pipe()
    inward, write_end = os.pipe()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [sys.executable, "-c", LAUNCHER, str(read_end), str(write_end), PROGRAM]
        command += [*OPTIONS, *options, f"--user-data-dir={profile}"]
        process = subprocess.Popen(
            command, pass_fds=(read_end, write_end), start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(read_end)
        os.close(write_end)
        try:
            yield Browser(out, inward)
        finally:
            os.close(out)
            os.close(inward)
            try:
                os.killpg(process.pid, signal.SIGKILL)
            except ProcessLookupError:
                pass
            process.wait()
