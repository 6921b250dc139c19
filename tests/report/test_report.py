"""The report is one file that any browser opens."""

import base64

from cases.files.reports import PIXEL as PNG
from cases.files.reports import read
from cases.refusals import refused
from rom.errors import ConfigError
from rom.model import Report, Row
from rom.report import html


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


test_a_report_that_cannot_be_written_is_refused = refused(
    (lambda: html.write_report({}, "r.txt", title=""), r"\.html"),
    (lambda: html.write_report({}, "no such folder/r.html", title=""), "does not exist"),
    (lambda: html.picture("missing.png", ""), "must be a picture"),
    (lambda: html.table(("a", "b"), [(1,)], ""), "1 cells of the row"),
    error=ConfigError,
)
