"""Every argument of every tool for sheets given wrong: refused in words, or harmless."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from cases.refusals import refused
from cases.sheets import distorted
from rom.components import assumed_strain as sheets
from rom.components.assumed_strain import Actions, Drive, Load, Metal, Tool, Traction, sheet
from rom.components.assumed_strain.actions import prepared
from rom.errors import ConfigError, MaterialError, RomError

X, T = distorted((2, 2))
BODY, METAL = sheet(X, T), Metal(1.0, 0.3)
LOW = np.flatnonzero(np.repeat(X[:, 1] < 1e-9, 2))
HISTORY = np.zeros((*BODY.weights.shape, 5))
PAD = [(0, 1), (1, 1), (1, 2), (0, 2)]
WITH_TOOL = Actions(LOW, tools=[Tool("pad", PAD)])

NEVER = {  # what no argument of these tools takes
    "text": "text", "nan": np.nan, "complex": 1j, "object": object(), "ragged": [[1, 2], [3]],
    "rows of nan": np.full((9, 2), np.nan), "words": ["a", "b"], "dictionary": {"a": 1},
}  # fmt: skip
ODD = {  # some take one of these
    "None": None, "minus": -1, "huge": 1e300, "infinite": np.inf, "zero": 0, "half": 0.5,
    "nothing": [], "true": True, "condition": np.array([True, False]), "cube": np.zeros((2, 2, 2)),
    "halves": np.full((9, 2), 0.5), "far": [10**6], "minus one": [-1],
}  # fmt: skip

SOLID = {"body": BODY, "metal": METAL}
CALLS = {  # a call that works, and its arguments
    "sheet": (sheet, {"points": X, "triangles": T, "element": "F3", "state": "plane stress",
                      "thickness": 1.0}),
    "rectangle": (sheets.rectangle, {"n": (2, 2), "corners": [(0, 0), (1, 0), (1, 1), (0, 1)],
                              "diagonal": "/"}),
    "disc": (sheets.disc, {"center": (0, 0), "radius": 1.0, "n": 8}),
    "outer_sides": (sheets.outer_sides, {"body": BODY}),
    "forces": (sheets.forces, SOLID | {"x": X, "history": HISTORY}),
    "tangent": (sheets.tangent, SOLID | {"x": X, "history": HISTORY}),
    "mass": (sheets.mass, SOLID),
    "stiffness_by_sides": (sheets.stiffness_by_sides, SOLID | {"share": (0, 1)}),
    "in_space": (sheets.in_space, SOLID | {"interfaces": {"all": np.arange(9)}}),
    "fly": (sheets.fly, SOLID | {"v": 0 * X, "held": LOW, "t_end": 0.1, "pictures": 3,
                                 "actions": WITH_TOOL}),
    "equilibrium": (sheets.equilibrium, SOLID | {"load": 0.001 + 0 * X, "held": LOW, "steps": 1}),
    "quasi_static": (sheets.quasi_static, SOLID | {"actions": WITH_TOOL, "times": [0.0, 1.0]}),
    "implicit_motion": (sheets.implicit_motion, SOLID | {
        "actions": WITH_TOOL, "times": [0.0, 1.0], "v": 0 * X, "rho_inf": 0.5}),
    "Metal": (Metal, {"E": 1.0, "nu": 0.3, "rho": 1.0, "yield_stress": 1.0, "hardening": 0.0,
                      "linear": False}),
}  # fmt: skip


def outcome(act):
    """Error in words, or None where it works; anything else than that is a failure of the test."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            act()
        except RomError as error:
            return str(error)
    return None


def test_every_tool_is_tried():
    records = {"Actions", "Course", "Drive", "Flight", "Load", "Sheet", "Tool", "Traction"}
    assert set(sheets.__all__) - records == set(CALLS)
    for function, given in CALLS.values():
        assert outcome(lambda f=function, g=given: f(**g)) is None


RECORDS = {
    "held": lambda v: Actions(v),
    "loads": lambda v: Actions(LOW, loads=v),
    "tractions": lambda v: Actions(LOW, tractions=v),
    "drives": lambda v: Actions(LOW, drives=v),
    "tools": lambda v: Actions(LOW, tools=v),
    "load 0": lambda v: Actions(LOW, loads=[Load(v)]),
    "load 0:": lambda v: Actions(LOW, loads=[Load(0 * X, v)]),
    "traction 0: sides": lambda v: Actions(LOW, tractions=[Traction(v, 1.0)]),
    "traction 0": lambda v: Actions(LOW, tractions=[Traction([(0, 1)], v)]),
    "traction 0 ": lambda v: Actions(LOW, tractions=[Traction([(0, 1)], 0.0, v)]),
    "traction 0:": lambda v: Actions(LOW, tractions=[Traction([(0, 1)], 1.0, 0.0, v)]),
    "drive 0: dofs": lambda v: Actions(LOW, drives=[Drive(v, 0.0)]),
    "drive 0:": lambda v: Actions(LOW, drives=[Drive([17], v)]),
    "tool 'pad': the outline": lambda v: Actions(LOW, tools=[Tool("pad", v)]),
    "tool 'pad': friction": lambda v: Actions(LOW, tools=[Tool("pad", PAD, v)]),
    "tool 'pad':": lambda v: Actions(LOW, tools=[Tool("pad", PAD, 0.0, v)]),
}

KNOWN_AS = {"x": "positions", "load": "forces of load", "v": "velocities"}  # inside of a tool
TRIED = {  # what is tried: names by which a message may call it, and a call with any value of it
    **{f"{call}.{name}": ((name, KNOWN_AS.get(name, name)),
                          lambda value, f=f, given=given, name=name: f(**given | {name: value}))
       for call, (f, given) in CALLS.items() for name in given},
    **{name: ((name.strip(),), lambda value, make=make: prepared(BODY, make(value)))
       for name, make in RECORDS.items()},
}  # fmt: skip


@pytest.mark.parametrize("tried", TRIED)
def test_what_fits_nowhere_is_refused_by_its_name_and_odd_values_do_no_harm(tried):
    names, act = TRIED[tried]
    for what in NEVER.keys() - ({"dictionary"} if tried == "in_space.interfaces" else ()):
        words = outcome(lambda v=NEVER[what]: act(v))
        assert words is not None, f"{what} was taken"
        assert words.endswith(".") and "Traceback" not in words, words
        assert any(name in words for name in names), f"{what}: {words}"
    for value in ODD.values():
        outcome(lambda v=value: act(v))


test_the_culprit_and_its_cure = refused(
    (lambda: sheet(np.vstack([X, [(3, 3)]]), T), RomError,
     "1 of 10 points belong to no triangle, the first is 9"),
    (lambda: sheet(X, T + 0.5), ConfigError, "triangles = .* are whole"),
    (lambda: prepared(BODY, Actions(LOW + 0.5)), ConfigError, "held dofs = .*flatnonzero"),
    (lambda: prepared(BODY, Actions(loads=Load(0 * X))), ConfigError, "loads = .*Load"),
    (lambda: prepared(BODY, Actions(tools=[PAD])), ConfigError, r"tools\[0\] = .* Tool"),
    (lambda: sheets.forces(BODY, METAL, X, HISTORY[:3]), ConfigError, "history has shape"),
    (lambda: Metal(True, 0.3), MaterialError, "E = True is not made of numbers"),
    (lambda: Metal(1.0, 0.3, np.inf), MaterialError, "rho = inf"),
    (lambda: sheets.quasi_static(BODY, METAL, Actions([0, 2]), [0, 1]), ConfigError,
     "leave 2 of three rigid motions"),
    (lambda: sheets.equilibrium(BODY, METAL, 0 * X, []), ConfigError,
     "leave 3 of three rigid motions"),
    (lambda: sheets.equilibrium(
        sheet(X, T, state="axisymmetric"), METAL, 0 * X, [0]), ConfigError,
     "slide along its axis"),
)  # fmt: skip


def test_all_nodes_driven_an_infinite_friction_and_a_metal_that_never_yields_are_allowed():
    moved = Actions(drives=[Drive(range(18), ((0, 1), (0, 0.1)))])
    course = sheets.quasi_static(BODY, METAL, moved, [0, 1])
    assert np.allclose(course.x[-1], X + 0.1)
    assert np.abs(course.reactions).max() < 1e-9
    prepared(BODY, replace(WITH_TOOL, tools=[Tool("pad", PAD, np.inf)]))
    assert Metal(1.0, 0.3, 1.0, np.inf).yield_stress == np.inf
