"""Errors say the cure, and warnings name the line of the user that caused them."""

from functools import cache

import numpy as np
import pytest

import rom
from cases.mbs.mechanisms import random_body
from cases.solid import block, reduced
from rom import errors


@pytest.mark.once
def test_the_cure_is_what_is_given_or_the_last_clause_which_is_not_said_twice():
    for message, cure in (
        ("no body 'a'; the mechanism has ['b'].", "the mechanism has ['b']."),
        ("K has shape (2, 3), needed is (3, 3).", "K has shape (2, 3), needed is (3, 3)."),
        ("the wheel turns. Use 3.5 m", "Use 3.5 m"),
    ):
        error = errors.ConfigError(message)
        assert (error.hint, str(error)) == (cure, message)
    error = errors.ConfigError("n must be 1.", where="here", hint="Leave n out.")
    assert (error.hint, str(error)) == ("Leave n out.", "here: n must be 1. Leave n out.")
    assert errors.FileFormatError("a number is missing.").hint == errors.FileFormatError.advice


@pytest.fixture(scope="module")
def things(tmp_path_factory):
    model = block(cells=(2, 1, 1))
    body = random_body(np.random.default_rng(3))
    mech = rom.Mechanism(gravity=(0, 0, 0))
    solid = {"mass": 1.0, "inertia": (1.0, 1.0, 1.0), "markers": {"m": (1, 0, 0)}}
    a, b = (mech.add_rigid(name, at=(0, 0, z), **solid) for name, z in (("a", 0), ("b", 1)))
    sol = rom.simulate(mech, t_end=0.02, dt=0.01)
    folder = tmp_path_factory.mktemp("files")
    for ending in ("SID_FEM", "bdf", "toml", "op4", "unv", "npz"):
        (folder / f"x.{ending}").write_text("$ a text\n")
    return {"model": model, "body": body, "mech": mech, "a": a, "b": b, "state": sol.final,
            "sol": sol, "folder": folder}  # fmt: skip


TO_TIP = {"interfaces": {"root": "rbe2"}, "certify": False}
WRONG_CALLS = {  # call: words of the message or hint
    "rom.reduce(model, method=rom.CraigBampton, **TO_TIP)":
        r"CraigBampton is a class; write CraigBampton\(n_modes=20\)",
    "rom.reduce(rom.FEModel, **TO_TIP)": "FEModel is a class; write",
    'rom.reduce(model, interfaces={"root": rom.Polynomial})': r"rom.Polynomial\(order\)",
    'sol.position("a", b.marker("m"))': r"Write \('b', 'm'\)",
    'sol.position(a, "m")': "write 'a'",
    'rom.reduce(model, method="rubin", **TO_TIP)':
        r"^reduce: method = 'rubin' must be .* Method \(such as rom.CraigBampton\(n_modes=20\)",
    'mech.revolute("j", a, b.marker("m"), axis=(0, 0, 1))':
        r"^Mechanism.revolute 'j': m1 = .* of type Marker \(from part.marker\(place\)",
    'state.position("a")': "rom.snapshot.mechanism, state",
    "sol.positions": "'position'",
    'mech.add_body("c")': "Write add_rigid, or add_flexible",
    'rom.load(folder / "x.SID_FEM")': "rom.read_sid",
    'rom.load(folder / "x.bdf")': "rom.fe.model",
    'rom.load(folder / "x.op4")': "rom.read_model",
    'rom.load(folder / "y.npz")': "Relative paths",
    'mech.add_rigid("a", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0))': "in use are",
}  # fmt: skip


@pytest.mark.once
@pytest.mark.parametrize("case", WRONG_CALLS)
def test_a_wrong_call_is_answered_with_the_way_that_works(case, things):
    with pytest.raises(rom.RomError, match=WRONG_CALLS[case]) as caught:
        eval(case, globals() | things)
    assert caught.value.hint


@pytest.mark.once
def test_an_unknown_name_is_still_an_attribute_error(things):
    assert not hasattr(things["sol"], "positions")
    with pytest.raises(AttributeError) as caught:
        _ = things["mech"]._no_such
    assert not isinstance(caught.value, rom.RomError)
    with pytest.raises(AttributeError, match=r"near are.*'reduce'"):
        _ = rom.Reduce
    assert issubclass(rom.UnknownNameError, AttributeError)


@cache
def rod():
    return reduced(4, block(), interfaces={"root": "rbe2"}, reference="root")


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
    with pytest.warns(rom.RomWarning, match=words) as caught:
        call(tmp_path)
    (one,) = (found for found in caught if words in str(found.message))
    lines = {line for _, _, line in call.__code__.co_lines()}
    assert (one.filename, one.lineno in lines) == (__file__, True)
