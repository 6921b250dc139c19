"""The report is one file that any browser opens."""

import base64

import pytest

from cases.files.reports import read
from rom.errors import ConfigError
from rom.model import Report, Row
from rom.report import html

PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAQAAAC1HAwCAAAAC0lEQVR42mNk+M8AAAMBAQDJ/pLvAAAAAElFTkSuQmCC"
)


def test_the_report_needs_no_other_file(tmp_path):
    (tmp_path / "a.png").write_bytes(PNG)
    checks = Report("x", (Row("mass", 1.25, "<= 2", True), Row("gap & co", 3.0, "<= 2", False)))
    path = html.write_report(
        {
            "One": [html.paragraph("a < b"), html.picture(tmp_path / "a.png", "It's small")],
            "Two": [
                html.table(("f [Hz]", "n"), [(123.456789, 3), ("x<y", 4)], "Numbers"),
                html.checks(checks, "Checks"),
            ],
        },
        tmp_path / "r.html",
        title="Beam <1 m>",
    )
    reader = read(path)
    assert [base64.b64decode(link.split(",")[1]) for link in reader.links] == [PNG]
    for words in ("Beam <1 m>", "a < b", "It's small", "123.46", "x<y", "gap & co", "failed"):
        assert words in reader.text


def test_a_report_that_cannot_be_written_is_refused(tmp_path):
    with pytest.raises(ConfigError, match=r"\.html"):
        html.write_report({}, tmp_path / "r.txt", title="")
    with pytest.raises(ConfigError, match="does not exist"):
        html.write_report({}, tmp_path / "no" / "r.html", title="")
    with pytest.raises(ConfigError, match="must be a picture"):
        html.picture(tmp_path / "missing.png", "")
    with pytest.raises(ConfigError, match="1 cells of the row"):
        html.table(("a", "b"), [(1,)], "")
