"""Records in a notebook: short and escaped, with figures in frames of their own."""

import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser

import numpy as np
import pytest

import rom
from cases.solid import block, reduced
from rom.model import Report, Row
from rom.notebook import MAX_ROWS, html_table, listed
from rom.report import html


class Cells(HTMLParser):
    """Texts of the cells of a table, row by row; tags must close."""

    def __init__(self, text):
        super().__init__()
        self.rows, self.open = [], []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "td" in self.open or "th" in self.open:
            self.rows[-1][-1] += data


def test_texts_are_escaped_numbers_short_and_long_tables_cut():
    text = html_table("a < b", ("x", "y"), [("<script>", 1.23456789), (3, np.float64(2e-9))])
    assert "<script>" not in text and text.startswith("<div><b>a &lt; b</b>")
    assert Cells(text).rows == [["x", "y"], ["<script>", "1.2346"], ["3", "2e-09"]]
    rows = Cells(html_table("", ("k",), [(k,) for k in range(MAX_ROWS + 7)])).rows
    assert len(rows) == MAX_ROWS + 2 and rows[-1] == ["and 7 more"]
    assert listed("abcdefghij") == "a, b, c, d, e, f, g, h, and 2 more" and listed(()) == "none"


def test_a_body():
    bar = reduced(4, block(cells=(4, 1, 1)), name="<b>bar")
    rows = dict(Cells(bar._repr_html_()).rows)
    assert float(rows["mass [kg]"]) == pytest.approx(bar.mass, rel=1e-4)
    assert rows["interface tip"].startswith("rbe2 at [1.0, ") and rows["certificate"] == "none"
    assert rows["elastic coordinates"] == str(bar.n_modes)
    assert "<b>bar" not in bar._repr_html_()
    assert repr(bar).startswith("FlexibleBody('<b>bar': 62.8 kg, ") and len(repr(bar)) < 200


def test_a_figure_stands_in_a_frame_and_a_large_one_or_none_in_no_way(monkeypatch):
    bar = reduced(4, block(cells=(4, 1, 1)), name="bar")
    text = bar._repr_html_()
    (frame,) = re.findall(r'<iframe sandbox="allow-scripts" .*? srcdoc="([^"]*)"></iframe>', text)
    assert len(frame) < html.MAX_FRAME_CHARACTERS < 5e6
    assert "<figure class='scene" in unescape(frame) and "<script" not in text
    monkeypatch.setattr(html, "MAX_FRAME_CHARACTERS", len(frame) - 1)
    for text in (bar._repr_html_(), replace(bar, surface=None)._repr_html_()):
        assert "<iframe" not in text and len(Cells(text).rows) > 8


def test_a_report_begins_with_what_fails():
    report = Report("gate", (Row("good", 1.0, "<= 2", True), Row("bad", 3.0, "<= 2", False)))
    assert [row[0] for row in Cells(report._repr_html_()).rows] == ["quantity", "bad", "good"]
    assert "FAILED" in report._repr_html_()
    assert repr(report) == "Report('gate': 1 of 2 failed)" and "bad" in str(report)
    assert "gate: 1 of 2 failed" in str(report) and not report.ok
    assert [row.quantity for row in report.failures] == ["bad"]


def test_a_motion_and_its_mechanism():
    mech, markers = rom.Mechanism(gravity=(0, 0, -9.81)), {"o": (0, 0, 0)}
    bob = mech.add_rigid("<bob>", mass=2.5, inertia=(1, 1, 1), at=(1, 0, 0), markers=markers)
    mech.spherical("pivot", mech.ground.marker((1, 0, 0)), bob.marker("o"))
    mech.event("never", lambda t, instant: 1.0 + t)
    motion = rom.simulate(mech, t_end=0.01, dt=1e-3)
    rows = dict(Cells(motion._repr_html_()).rows)
    assert rows["instants"] == "11" and rows["bodies"] == "<bob>"
    assert rows["event never"] == "0 times"
    assert "energy" not in vars(motion)
    assert repr(motion) == "Solution(11 instants, 0 to 0.01 s, bodies <bob>: Reached t = 0.01 s.)"
    mechanism = motion.mechanism
    assert Cells(mechanism._repr_html_()).rows[1:] == [
        ["<bob>", "rigid", "2.5", "o"],
        ["pivot", "spherical", "", "ground.(1.0, 0.0, 0.0), <bob>.o"],
    ]
    assert repr(mechanism) == "Mechanism(bodies <bob>; joints pivot)"
