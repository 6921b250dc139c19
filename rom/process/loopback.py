"""A page that only this machine sees: served on the loopback until its reader closes it.

The address holds a token that nobody else knows. Requests for another name of the machine, which a
foreign page could have made the browser ask for, and orders from a page of another origin get no
answer. The page keeps one stream of events open: when it ends, nobody looks any more.
"""

import json
import secrets
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from rom.errors import ConfigError

MAX_BYTES = 65536  # of an order
MAX_SILENCE = 10.0  # of whoever connects [s]
BEAT = 0.5  # between signs of life to the page [s]
LEAVE = 3.0  # after which a page that was closed has not merely been loaded again [s]
HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "SAMEORIGIN",
    "Cross-Origin-Resource-Policy": "same-origin",
}
Order = Callable[[dict[str, Any]], object]


class Loopback(ThreadingHTTPServer):
    """Pages by name, "" the first, and orders by name; `tell` sends events to the page.

    An order that raises ConfigError answers with its words.
    """

    daemon_threads = True

    def __init__(self, pages: Callable[[str], bytes | None], orders: Mapping[str, Order]) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.pages, self.orders = pages, orders
        self.token = secrets.token_urlsafe(24)
        self.host = f"127.0.0.1:{self.server_port}"
        self.told: list[dict[str, object]] = []
        self.news = threading.Condition()
        self.reader: object = None  # of the events
        self.left = 0.0  # when it went [s]

    @property
    def address(self) -> str:
        """What the browser opens."""
        return f"http://{self.host}/{self.token}/"

    def tell(self, **event: object) -> None:
        """An event for the page, now or when it is loaded again."""
        with self.news:
            self.told.append(event)
            self.news.notify_all()

    def until_closed(self) -> None:
        """Serve until the page has been closed."""
        threading.Thread(target=self.serve_forever, daemon=True).start()
        try:
            while not self.left or self.reader or time.monotonic() < self.left + LEAVE:
                time.sleep(0.1)
        finally:
            self.shutdown()
            self.server_close()

    def handle_error(self, *_: object) -> None:
        """A browser that hangs up in the middle is no matter for the terminal."""


class _Handler(BaseHTTPRequestHandler):
    server: Loopback
    protocol_version = "HTTP/1.1"
    timeout = MAX_SILENCE

    def do_GET(self) -> None:
        """A page, or the events."""
        name = self._asked()
        if name == "events":
            self._events()
            return
        found = None if name is None else self.server.pages(name)
        self._answer(404 if found is None else 200, found or b"", "text/html; charset=utf-8")

    def do_POST(self) -> None:
        """An order, with its options as JSON."""
        order = self.server.orders.get(self._asked() or "")
        length = self.headers.get("Content-Length", "")
        own = self.headers.get("Origin") == f"http://{self.server.host}"
        if order is None or not own:
            self._answer(404)
        elif not length.isdecimal() or int(length) > MAX_BYTES:
            self._answer(413)
        else:
            self._obey(order, self.rfile.read(int(length)))

    def _obey(self, order: Order, text: bytes) -> None:
        try:
            options = json.loads(text)
            if not isinstance(options, dict):
                raise ValueError
            found = order(options)
        except ConfigError as error:
            self._answer(400, str(error).encode())
        except ValueError:
            self._answer(400, b"this is no JSON object")
        else:
            self._answer(200, json.dumps(found).encode(), "application/json")

    def _asked(self) -> str | None:
        """What is behind the token, if it and the name of the machine are right."""
        _, token, *name = self.path.split("/", 2)
        known = secrets.compare_digest(token.encode(), self.server.token.encode())
        known = known and self.headers.get("Host") == self.server.host
        return name[0] if known and name else None

    def _answer(
        self, code: int, body: bytes = b"", kind: str = "text/plain; charset=utf-8"
    ) -> None:
        # what is left of a request that was not read is no other request
        close = {"Connection": "close"} if code != 200 else {}
        self._head(code, {"Content-Type": kind, "Content-Length": str(len(body))} | close)
        self.wfile.write(body)

    def _head(self, code: int, more: dict[str, str]) -> None:
        self.send_response(code)
        for name, value in (HEADERS | more).items():
            self.send_header(name, value)
        self.end_headers()

    def _events(self) -> None:
        """All events so far and those to come, to one page at a time."""
        server = self.server
        with server.news:
            if server.reader:
                self._answer(409, b"this part is open in another window")
                return
            server.reader = self
        self.close_connection = True
        try:
            with suppress(OSError):
                self._head(200, {"Content-Type": "text/event-stream"})
                self._stream()
        finally:
            server.left, server.reader = time.monotonic(), None

    def _stream(self) -> None:
        server, sent = self.server, 0
        while True:
            with server.news:
                if len(server.told) == sent:
                    server.news.wait(BEAT)
                new = server.told[sent:]
            sent += len(new)
            text = "".join(f"data: {json.dumps(event)}\n\n" for event in new) or ": here\n\n"
            self.wfile.write(text.encode())

    def log_message(self, *_: object) -> None:
        """Nothing: the terminal is for what the part does."""
