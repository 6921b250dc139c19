"""Errors say the cure: a hint, a clause of the message that says it, or advice."""

import numpy as np
import pytest

import rom
from cases.mbs.mechanisms import random_body
from cases.solid import block
from rom import errors
from rom.errors import RomError, UnknownNameError

pytestmark = pytest.mark.once


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        ("n = -1 must be a whole number.", "n = -1 must be a whole number."),
        ("no body 'a'; the mechanism has ['b'].", "the mechanism has ['b']."),
        ("a.x has the ending '.x'; known: .mtx, .mm.", "known: .mtx, .mm."),
        ("K has shape (2, 3), needed is (3, 3).", "K has shape (2, 3), needed is (3, 3)."),
        ("the wheel turns. Use 3.5 m", "Use 3.5 m"),
        ("K is (2, 3); K must be a. b; c", "c"),
    ],
)
def test_the_cure_of_a_message_is_its_last_clause(message, expected):
    error = errors.ConfigError(message)
    assert error.hint == expected
    assert str(error) == message  # what the message says is not said twice


def test_a_given_hint_is_said_and_kept():
    error = errors.ConfigError("n must be 1.", where="here", hint="Leave n out.")
    assert (error.hint, str(error)) == ("Leave n out.", "here: n must be 1. Leave n out.")
    assert errors.FileFormatError("a number is missing.").hint == errors.FileFormatError.advice


@pytest.fixture(scope="module")
def things(tmp_path_factory):
    model = block(cells=(2, 1, 1))
    body = random_body(np.random.default_rng(3))
    mech = rom.Mechanism(gravity=(0, 0, 0))
    a = mech.add_rigid(
        "a", mass=1.0, inertia=(1.0, 1.0, 1.0), at=(0, 0, 0), markers={"m": (1, 0, 0)}
    )
    b = mech.add_rigid(
        "b", mass=1.0, inertia=(1.0, 1.0, 1.0), at=(0, 0, 1), markers={"m": (1, 0, 0)}
    )
    mech.revolute("hinge", a.marker("m"), mech.ground.marker((1, 0, 0)), axis=(0, 0, 1))
    sol = rom.simulate(mech, t_end=0.02, dt=0.01)
    folder = tmp_path_factory.mktemp("files")
    for ending in ("SID_FEM", "bdf", "msh", "toml", "op4", "unv", "npz"):
        (folder / f"x.{ending}").write_text("$ a text\n")
    return {"model": model, "body": body, "mech": mech, "a": a, "b": b, "state": sol.final,
            "sol": sol, "folder": folder}  # fmt: skip


TO_TIP = {"interfaces": {"root": "rbe2"}, "certify": False}
WRONG_CALLS = {  # name: (call, words of the message or hint)
    "class of a method": (
        lambda t: rom.reduce(t["model"], method=rom.CraigBampton, **TO_TIP),
        r"CraigBampton is a class; write CraigBampton\(n_modes=20\)",
    ),
    "another class of a method": (
        lambda t: rom.reduce(t["model"], method=rom.Rubin, **TO_TIP),
        r"Rubin is a class; write Rubin\(n_modes=20\)",
    ),
    "function of a method": (
        lambda t: rom.reduce(t["model"], method=rom.craig_bampton, **TO_TIP),
        r"such as rom.CraigBampton\(n_modes=20\)",
    ),
    "name of a method": (
        lambda t: rom.reduce(t["model"], method="craig_bampton", **TO_TIP),
        r"such as rom.CraigBampton\(n_modes=20\)",
    ),
    "class of a model": (lambda t: rom.reduce(rom.FEModel, **TO_TIP), "FEModel is a class; write"),
    "class of damping": (
        lambda t: rom.reduce(t["model"], damping=rom.Rayleigh, **TO_TIP),
        r"Rayleigh is a class; write Rayleigh\(alpha=...\)",
    ),
    "class of a range": (
        lambda t: rom.reduce(t["model"], nonlinear=rom.Geometric, **TO_TIP),
        "Geometric is a class; write Geometric",
    ),
    "class of an interface": (
        lambda t: rom.reduce(t["model"], interfaces={"root": rom.Polynomial}),
        r"rom.Polynomial\(order\)",
    ),
    "class of a mechanism": (lambda t: rom.simulate(rom.Mechanism, t_end=1.0), "is a class; write"),
    "class of keeping": (
        lambda t: rom.simulate(t["mech"], t_end=1.0, keep=rom.Keeping),
        "Keeping is a class; write",
    ),
    "marker of another body": (
        lambda t: t["sol"].position("a", t["b"].marker("m")),
        r"Write \('b', 'm'\)",
    ),
    "unknown marker": (lambda t: t["sol"].position("a", "end"), r"\['m'\]"),
    "part for its name": (lambda t: t["sol"].position(t["a"], "m"), "write 'a'"),
    "part for a joint": (lambda t: t["mech"].drive("d", t["a"], lambda t: t), "write 'a'"),
    "part for a marker": (
        lambda t: t["mech"].revolute("j", t["a"], t["b"].marker("m"), axis=(0, 0, 1)),
        r"from part.marker\(place\)",
    ),
    "position of a state": (lambda t: t["state"].position("a"), "rom.snapshot.mechanism, state"),
    "positions": (lambda t: t["sol"].positions, "'position'"),
    "add_body": (lambda t: t["mech"].add_body("c"), "Write add_rigid, or add_flexible"),
    "add_revolute": (lambda t: t["mech"].add_revolute("c"), "'revolute'"),
    "frequency": (lambda t: t["body"].frequency, "'frequencies'"),
    "frequencies of a model": (lambda t: t["model"].frequencies, r"rom.modes\(model, 12\)"),
    "load SID": (lambda t: rom.load(t["folder"] / "x.SID_FEM"), "rom.read_sid"),
    "load bulk data": (lambda t: rom.load(t["folder"] / "x.bdf"), "rom.fe.model"),
    "load a mesh": (lambda t: rom.load(t["folder"] / "x.msh"), "rom.fe.model"),
    "load a mechanism": (lambda t: rom.load(t["folder"] / "x.toml"), "rom.read_mechanism"),
    "load matrices": (lambda t: rom.load(t["folder"] / "x.op4"), "rom.read_model"),
    "load a test": (lambda t: rom.load(t["folder"] / "x.unv"), "rom.io.read_responses"),
    "load a cut body": (lambda t: rom.load(t["folder"] / "x.npz"), "cut in a transfer"),
    "load nothing": (lambda t: rom.load(t["folder"] / "y.npz"), "Relative paths"),
    "unit": (lambda t: rom.units.in_si("3 furlong", "m"), "unit"),
    "steps": (lambda t: rom.simulate(t["mech"], t_end=-1.0), "t_end"),
    "method of steps": (lambda t: rom.simulate(t["mech"], t_end=1.0, method="euler"), "bdf"),
    "name in use": (
        lambda t: t["mech"].add_rigid("a", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0)),
        "in use are",
    ),
    "negative mass": (
        lambda t: t["mech"].add_rigid("c", mass=-1.0, inertia=(1, 1, 1), at=(0, 0, 0)),
        "mass",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG_CALLS)
def test_a_wrong_call_is_answered_with_the_way_that_works(case, things):
    call, words = WRONG_CALLS[case]
    with pytest.raises(RomError, match=words) as caught:
        call(things)
    assert caught.value.hint


def test_an_unknown_name_is_still_an_attribute_error(things):
    """So that hasattr, copies and pickles of records go on."""
    assert not hasattr(things["sol"], "positions")
    with pytest.raises(AttributeError) as caught:
        _ = things["mech"]._no_such
    assert not isinstance(caught.value, RomError)
    with pytest.raises(AttributeError, match=r"near are.*'reduce'"):
        _ = rom.Reduce
    assert issubclass(UnknownNameError, AttributeError)
