"""Whatever is refused in a file of a mechanism is named with file and line: generated mistakes."""

import re

import pytest

import rom
from rom.errors import RomError

MECHANISM = """\
gravity = [0.0, 0.0, -9.81]

[bodies.crank]
mass = "1 kg"
inertia = [1.0, 1.0, 1.0]
at = [0.1, 0.0, 0.0]
markers = { pin = [0.0, 0.0, 0.0], end = [0.2, 0.0, 0.0] }

[bodies.rod]
mass = 2.0
inertia = [1.0, 1.0, 1.0]
at = [0.3, 0.0, 0.0]
markers = { end = [0.0, 0.0, 0.0] }

[joints.main]
kind = "revolute"
between = [{ ground = [0.1, 0.0, 0.0] }, "crank.pin"]
axis = [0.0, 0.0, 1.0]

[drives.motor]
joint = "main"
law = 1.0

[simulation]
t_end = "0.1 s"
dt = 1e-3
"""
WRONG = ('"text"', "-1.0", "[]", "true", "[1.0]", "1e999", "nan", '"3 furlong"', "{ a = 1 }")


def mutants():
    """One mistake each: another value, no value, no line, an unknown key, a name that is none."""
    lines = MECHANISM.splitlines()
    for k, line in enumerate(lines):
        key, _, value = line.partition(" = ")
        changes = [f"{key} = {wrong}" for wrong in WRONG] if value else []
        changes += [line.replace(key, f"{key}x", 1), f"{key} ="] if value else []
        changes += ["", line.replace('"main"', '"mian"'), line.replace("crank.pin", "crank.pni")]
        changes += [line.replace("[bodies.rod]", "[bodies.crank]"), line.replace("]", "", 1)]
        for change in dict.fromkeys(changes):
            if change != line:
                yield k + 1, change, "\n".join([*lines[:k], change, *lines[k + 1 :]]) + "\n"


@pytest.mark.once
def test_every_refusal_of_a_mechanism_file_has_file_line_and_cure(tmp_path):
    path = tmp_path / "crank.toml"
    refused, taken = 0, []
    for k, change, text in mutants():
        path.write_text(text)
        key, _, value = change.partition(" = ")
        try:
            rom.read_mechanism(path).mechanism()
        except RomError as error:
            refused += 1
            assert re.search(r"crank\.toml:\d+", error.where), (k, change, str(error))
            assert error.hint, (k, change, str(error))
            assert value not in WRONG or key in str(error), (k, change, str(error))
        else:
            taken.append(change)
    assert set(taken) == {"", "law = -1.0"} and refused > 200


def test_what_is_missing_altogether_has_the_line_behind_which_it_goes(tmp_path):
    path = tmp_path / "crank.toml"
    path.write_text("[simulation]\nt_end = 1.0\n")
    with pytest.raises(RomError, match=r"crank\.toml:2: bodies is missing"):
        rom.read_mechanism(path)
    path.write_text(MECHANISM.replace("t_end", "tend"))
    with pytest.raises(RomError, match=r"crank\.toml:\d+: 2 mistakes"):
        rom.read_mechanism(path)
