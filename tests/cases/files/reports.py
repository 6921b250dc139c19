"""Reports, read back; a picture and a body for them."""

import base64
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np

import rom
from cases.solid import KINDS, block
from rom.body.recovery import StressRecovery

PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAQAAAC1HAwCAAAAC0lEQVR42mNk+M8AAAMBAQDJ/pLvAAAAAElFTkSuQmCC"
)


def bar_that_bends():
    """A body whose stress is made up: per metre, 1 GPa of xx along y, and of xy along z."""
    made = rom.reduce(block(cells=(8, 2, 2)), method=rom.CraigBampton(6), reference="root",
                      interfaces=KINDS, name="bar")  # fmt: skip
    operator = np.zeros((6 * len(made.surface.points), made.n_modes))
    operator[0::6] = 1e9 * made.surface.shape[1::3]
    operator[5::6] = 1e9 * made.surface.shape[2::3]
    return replace(made, stress=StressRecovery(made.surface.points, operator))


class Reader(HTMLParser):
    """Collects tags, text, links, scripts and styles with their attributes, and the policy."""

    def __init__(self):
        super().__init__()
        self.open, self.tags, self.links, self.found = [], [], [], []
        self.text, self.policy = "", None

    def handle_starttag(self, tag, attrs):
        given = dict(attrs)
        self.tags.append(tag)
        if tag not in ("meta", "img"):
            self.open.append(tag)
        if tag in ("script", "style"):
            self.found.append((tag, given, ""))
        if given.get("http-equiv") == "Content-Security-Policy":
            self.policy = given["content"]
        self.links += [given[key] for key in ("src", "href") if key in given]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data
        if self.cdata_elem:
            tag, given, text = self.found[-1]
            self.found[-1] = tag, given, text + data


def read(path):
    reader = Reader()
    reader.feed(path.read_text(encoding="utf-8"))
    assert not reader.open
    return reader
