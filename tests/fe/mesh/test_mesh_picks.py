"""Words that pick faces, without a geometry."""

import json
from dataclasses import asdict

import numpy as np
import pytest

from cases.refusals import refuses
from rom.errors import ConfigError
from rom.fe.mesh.cad import Axis, Face, from_plain
from rom.fe.mesh.picks import Pick, is_pick, picks

PICKS = {
    "12": [Pick("number", (12,), "12")],
    "0.1,0,2e-2": [Pick("point", (0.1, 0.0, 0.02), "0.1,0,2e-2")],
    "radius:0.006": [Pick("radius", (0.006,), "radius:0.006")],
    "normal:0,0,-1": [Pick("normal", (0.0, 0.0, -1.0), "normal:0,0,-1")],
    "3+4": [Pick("number", (3,), "3"), Pick("number", (4,), "4")],
    "3 + 0,0,1e+3": [Pick("number", (3,), "3"), Pick("point", (0.0, 0.0, 1e3), "0,0,1e+3")],
}


@pytest.mark.parametrize(("text", "expected"), PICKS.items())
def test_words_pick_faces_and_names_do_not(text, expected):
    assert list(picks(text)) == expected and is_pick(text)
    for name in ("pin_a", "bolt 3", "a", "e", "Grund:oben"):
        assert not is_pick(name)


def test_python_picks_by_numbers_points_and_boxes():
    assert [pick.kind for pick in picks([3, "4+radius:1", (0, 0, 1), np.zeros(6)])] == [
        "number", "number", "radius", "point", "box"]  # fmt: skip
    assert picks(np.int64(7)) == picks(7) == picks("7")
    assert picks([3, 4]) == picks("3+4")
    assert [pick.kind for pick in picks([3, 4, 5])] == ["point"]


@pytest.mark.parametrize(
    "wrong",
    ["", "pin", "1,2", "3+", "+3", "3-5", "1.5", "-3", "radius:", "radius:0", "radius:-1",
     "radius:1,2", "radius:nan", "normal:0,0", "normal:0,0,0", "colour:red", "nan,0,0", "inf,0,0",
     True, 1.5, None, [], [1.0, 2.0], [True, False], (np.nan, 0, 0), {"number": 3}],
)  # fmt: skip
def test_what_picks_nothing_is_refused(wrong):
    refuses(ConfigError, "is no face", picks, wrong)


def test_records_survive_json_and_scale_but_for_directions():
    face = Face(7, "cylinder", 3.0, (1.0, 2.0, 3.0), 0.5, (0.0, 0.0, 1.0), (1.0, 2.0, 0.0))
    there = json.loads(json.dumps(asdict(face)))
    assert from_plain(Face, there, 1.0) == face
    doubled = Face(7, "cylinder", 12.0, (2.0, 4.0, 6.0), 1.0, (0.0, 0.0, 1.0), (2.0, 4.0, 0.0))
    assert from_plain(Face, there, 2.0) == doubled
    axis = Axis((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), None)
    there = json.loads(json.dumps(asdict(axis)))
    assert from_plain(Axis, there, 3.0) == Axis((3.0, 0.0, 0.0), (0.0, 1.0, 0.0), None)
