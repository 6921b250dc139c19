"""A report is one file, which lets nothing in but its own scripts; no name ends an element."""

import base64
import hashlib
import re
from dataclasses import replace

import pytest

from cases.files.reports import PIXEL, read
from cases.paths import ROOT
from cases.refusals import refused
from cases.solid import block, reduced
from rom.errors import ConfigError
from rom.model import Report, Row
from rom.report import html, viewer

pytestmark = pytest.mark.once
VENDOR = ROOT / "rom" / "report" / "vendor"
NAME = "</script><b>bar"


@pytest.fixture(scope="module")
def body():
    return replace(reduced(2, block(cells=(4, 1, 1)), name="bar"), name=NAME)


def written(tmp_path, *blocks):
    return html.write_report({"One": blocks}, tmp_path / "r.html", title=NAME)


def test_the_policy_allows_what_is_there_and_nothing_else(body, tmp_path):
    parser = read(written(tmp_path, viewer.modes(body)))
    rules = dict(rule.split(" ", 1) for rule in parser.policy.split("; "))
    assert rules["default-src"] == "'none'" and rules["img-src"] == "data:"
    assert not re.search(r"unsafe|http|\*", parser.policy)

    def hashes(tag):
        return {
            f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
            for name, attrs, text in parser.found
            if name == tag and "type" not in attrs
        }

    assert set(rules["script-src"].split()) == hashes("script") and len(hashes("script")) == 2
    assert set(rules["style-src"].split()) == hashes("style") and len(hashes("style")) == 1


def test_no_name_ends_an_element_and_a_page_without_figures_runs_nothing(body, tmp_path):
    path = written(tmp_path, viewer.modes(body))
    assert NAME in read(path).text
    assert "b" not in read(path).tags
    scripts = [tag for tag, *_ in read(path).found if tag == "script"]
    assert path.read_text().count("</script>") == len(scripts)
    parser = read(written(tmp_path, html.paragraph("<figure class='scene'> is text here")))
    assert "script" not in parser.tags and "script-src 'none'" in parser.policy


def test_arrays_that_two_figures_share_are_sent_once(body, tmp_path):
    one, two = viewer.modes(body), viewer.modes(body)
    small = written(tmp_path, one).stat().st_size
    more = written(tmp_path, one, two).stat().st_size - small
    assert more == len(html.ARRAY_ELEMENT.sub("", two)) < len(two) - 1000
    names = [attrs["id"] for _, attrs, _ in read(tmp_path / "r.html").found if "id" in attrs]
    assert len(names) == len(set(names)) > body.n_modes
    wanted = set(re.findall(r'"ref":"(array-[0-9a-f]+)"', (tmp_path / "r.html").read_text()))
    assert wanted == set(names)


def test_what_others_wrote_is_what_was_vendored_and_used():
    words = (VENDOR / "README.md").read_text()
    data = (VENDOR / "three.min.js").read_bytes()
    assert re.search(r"sha256: ([0-9a-f]{64})", words)[1] == hashlib.sha256(data).hexdigest()
    version = re.search(r"three\.js ([\d.]+)", words)[1]
    assert f"three@{version}" in (VENDOR / "bundle.sh").read_text()
    text = data.decode("utf-8")
    licence = (VENDOR / "three.LICENSE").read_text(encoding="utf-8").strip()
    assert text.startswith(f"/*! three.js {version}\n{licence}")
    assert "</script" not in text.lower()
    assert set(re.findall(r"[a-z]+://[^\s\"'`]+", text)) == {"http://www.w3.org/1999/xhtml"}
    assert len(data) < 600_000
    ours = (ROOT / "rom" / "report" / "viewer.js").read_text()
    named = re.findall(r"\b[A-Z]\w+\b", (VENDOR / "three_part.js").read_text().split("\n", 1)[1])
    assert set(re.findall(r"THREE\.(\w+)", ours)) == set(named)


def test_the_report_needs_no_other_file(tmp_path):
    (tmp_path / "a.png").write_bytes(PIXEL)
    checks = Report("x", (Row("mass", 1.25, "<= 2", True), Row("gap & co", 3.0, "<= 2", False)))
    one = [html.paragraph("a < b"), html.picture(tmp_path / "a.png", "It's small")]
    two = [html.table(("f [Hz]", "n"), [(123.456789, 3), ("x<y", 4)], "Numbers")]
    two += [html.checks(checks, "Checks")]
    path = html.write_report({"One": one, "Two": two}, tmp_path / "r.html", title="Beam <1 m>")
    reader = read(path)
    assert [base64.b64decode(link.split(",")[1]) for link in reader.links] == [PIXEL]
    for words in ("Beam <1 m>", "a < b", "It's small", "123.46", "x<y", "gap & co", "failed"):
        assert words in reader.text


test_a_report_that_cannot_be_written_is_refused = refused(
    (lambda: html.write_report({}, "r.txt", title=""), r"\.html"),
    (lambda: html.write_report({}, "no such folder/r.html", title=""), "does not exist"),
    (lambda: html.picture("missing.png", ""), "must be a picture"),
    (lambda: html.table(("a", "b"), [(1,)], ""), "1 cells of the row"),
    error=ConfigError,
)
