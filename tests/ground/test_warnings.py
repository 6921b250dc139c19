"""A warning names the line of the user that caused it, through whatever lies between."""

import ast
from functools import cache

import pytest

import rom
from cases.paths import ROOT
from cases.solid import block
from rom.errors import RomWarning


@cache
def rod():
    return rom.reduce(block(), method=rom.CraigBampton(4), interfaces={"root": "rbe2"},
                      reference="root", certify=False)  # fmt: skip


def upside_down():
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    bob = mech.add_rigid("bob", mass=1.0, inertia=(1e-2,) * 3, at=(0, 0, 1.0))
    mech.revolute("pivot", mech.ground.marker((0, 0, 0)), bob.marker((0, 0, -1.0)), axis=(0, 1, 0))
    return mech


CALLS = {  # how the user's line comes to the warning: what is said
    "a record": (lambda _: rom.Material(2.1e5, 0.3, 7850.0), "sound"),
    "a method of a checked class": (
        lambda _: rod().rotating_frequencies(9.0, (0, 0, 1), fixed=("root",)), "softens it only"),
    "a function of a mechanism": (lambda _: rom.equilibrium(upside_down()), "is unstable"),
    "an export": (lambda folder: rom.export(rod(), folder / "rod.py"), "mass centre"),
}  # fmt: skip


@pytest.mark.parametrize("way", CALLS)
def test_a_warning_names_the_line_outside_the_package(way, tmp_path):
    call, words = CALLS[way]
    rod()
    with pytest.warns(RomWarning, match=words) as caught:
        call(tmp_path)
    (one,) = (found for found in caught if words in str(found.message))
    lines = {line for _, _, line in call.__code__.co_lines()}
    assert (one.filename, one.lineno in lines) == (__file__, True)


def test_all_warnings_go_one_way():
    """Numbers of frames are wrong as soon as a function between gets a decorator."""
    for path in (ROOT / "rom").rglob("*.py"):
        if path != ROOT / "rom/errors.py":
            calls = (
                n.func for n in ast.walk(ast.parse(path.read_text())) if isinstance(n, ast.Call)
            )
            assert "warnings.warn" not in map(ast.unparse, calls), path
