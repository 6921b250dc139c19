"""Tables and stages: what compiled code is told of arrays, and which kernels a system asks for."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

import rom
from benchmarks.models import rigid_chain
from cases.command import python
from cases.mbs.mechanisms import random_body
from cases.mbs.trusses import truss
from rom.body.nonlinear.quartic import Quartic, n_entries
from rom.body.nonlinear.sampled import Sampled
from rom.components.cosserat import body, straight
from rom.components.gear_mesh.gears.geometry import GearPair
from rom.fields import families
from rom.mbs.equations.packing import pack
from rom.mbs.integrate import step_memory
from rom.mbs.kernels.compiled import kernel
from rom.mbs.kernels.stages import STAGE_KERNELS, STAGE_NAMES, link, needed_by
from rom.mbs.kernels.tables import Array1, Array3, Index2, Table, table

WRONG = [np.zeros(3), np.zeros((2, 3, 4), dtype=int)]
WRONG += [np.zeros((4, 3, 2)).T, np.zeros((2, 3, 8))[..., ::2]]


@table
class Inner(Table):
    x: Array1
    n: int


@table
class Outer(Table):
    blocks: Array3
    at: Index2
    inner: Inner | None


@kernel
def probed(t, out):
    """Write a number from every field, and into one."""
    out[0], out[1], out[2] = t.blocks[1, 2, 3], t.at[2, 1], t.inner.x[1]
    out[3], out[4], out[5] = t.inner.n, t.blocks.shape[2], t.at.strides[0]
    t.inner.x[0] = -1.0


def outer():
    blocks = np.arange(24.0).reshape(2, 3, 4)
    return Outer(blocks, np.arange(6).reshape(3, 2), Inner(np.array([0.5, 1.5]), 7))


def test_compiled_code_reads_and_writes_the_arrays_of_a_table_and_of_its_copies():
    t, out = outer(), np.zeros(6)
    probed(t, out)
    np.testing.assert_array_equal(out, [t.blocks[1, 2, 3], 5, 1.5, 7, 4, 16])
    assert t.inner.x[0] == -1.0
    t, out = outer(), np.zeros((2, 6))
    again, changed = pickle.loads(pickle.dumps(t)), t.replace(inner=Inner(np.array([3.0, 4.0]), 8))
    probed(again, out[0])
    probed(changed, out[1])
    np.testing.assert_array_equal(out, [[23, 5, 1.5, 7, 4, 16], [23, 5, 4.0, 8, 4, 16]])
    assert t.inner.x[0] == 0.5 and changed.blocks is t.blocks


@pytest.mark.parametrize("wrong", WRONG)
def test_an_array_that_compiled_code_would_misread_is_refused(wrong):
    with pytest.raises(TypeError, match=r"Outer.blocks is an array of"):
        outer().replace(blocks=wrong)


def pair():
    """Two bodies that slide on a line, for elements between them."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    for name, x in (("a", 0.0), ("b", 1.0)):
        mech.add_rigid(name, mass=1.0, inertia=(0.1,) * 3, at=(x, 0, 0))
    mech.prismatic("slide", "a", "b", axis=(1, 0, 0))
    return mech, "a", "b"


def flexible_body(mech, **kind):
    soft = random_body(np.random.default_rng(1), **kind)
    return soft, mech.add_flexible("c", soft)


def loaded_body(mech):
    soft, part = flexible_body(mech)
    mech.spread_load("weight", part, rom.mass_load(soft, (0, 0, -1.0)))


def bending_body(mech, *, sampled=False):
    """A flexible body whose energy is a quartic, or that of two points."""
    soft = random_body(np.random.default_rng(1), damped=False)
    energy = Quartic(soft.K, *(np.ones(n_entries(len(soft.K), order)) for order in (3, 4)))
    if sampled:
        gradients = np.random.default_rng(0).standard_normal((2, 9, soft.n_modes))
        energy = Sampled(soft.K, gradients, np.ones(2), np.ones((2, 2)))
    mech.add_flexible("c", replace(soft, quartic=energy))


def geared_body(mech, a, b):
    mech.prismatic("other", "ground", b, axis=(1, 0, 0))
    mech.gear("e", "slide", "other", ratio=2.0)


ROD = {"stretch": (5e5, 5e5, 1e6), "bend": (1e3, 2e3, 1.5e3), "mass": 1.0, "inertia": (1e-2,) * 3}
LAW = rom.mbs.Impact(stiffness=1e5)
WHEELS = {"pair": GearPair((50, 50), 0.02, 0.01), "axis": (0, 0, 1), "stiffness": 1.0}
BALLS = {"axis": (0, 0, 1), "bearing": rom.mbs.BallBearing(9, 0.0127, 0.065)}
FILM = {"axis": (0, 0, 1), "bearing": rom.mbs.JournalBearing(0.1, 0.05, 1e-4), "oil": 0.03}
WHEEL = {"mass": 1.0, "inertia": (1, 1, 1), "at": (0, 0, 0), "spin": (0, 0, 1)}
ELEMENTS = {  # family -> what asks for it
    "springs": lambda m, a, b: m.spring_damper("e", a, b, stiffness=1.0),
    "turns": lambda m, a, b: m.rotational_spring("e", hinge(m, b), stiffness=1.0),
    "loads": lambda m, a, b: m.force("e", a, (1, 0, 0)),
    "laws": lambda m, a, b: m.law("e", lambda t, p, motion, memory, out: None, a),
    "motors": lambda m, a, b: m.motor("e", "slide", lambda t, x, v: -x),
    "frictions": lambda m, a, b: m.friction("e", "slide", coulomb=1.0, transition_speed=0.1),
    "stops": lambda m, a, b: m.stop("e", "slide", LAW, upper=2.0),
    "bushings": lambda m, a, b: m.bushing("e", a, b, stiffness=[1.0] * 6),
    "contacts": lambda m, a, b: m.sphere_on_sphere("e", a, b, LAW, radius1=0.1, radius2=0.1),
    "spread_loads": lambda m, a, b: loaded_body(m),
    "nonlinear": lambda m, a, b: m.add_nonlinear("e", body(straight(1.0, 2, **ROD))),
    "bodies of large deflection": lambda m, a, b: bending_body(m),
    "bodies of sampled elements": lambda m, a, b: bending_body(m, sampled=True),
    "tendons": lambda m, a, b: m.tendon("e", [a, b], EA=1.0),
    "gear_meshes": lambda m, a, b: m.gear_mesh("e", a, b, **WHEELS),
    "rolling_bearings": lambda m, a, b: m.rolling_bearing("e", a, "ground", **BALLS),
    "journal_bearings": lambda m, a, b: m.journal_bearing("e", a, "ground", **FILM),
    "spins": lambda m, a, b: m.add_rigid("e", **WHEEL),
}
KERNELS = ("residuals", "tangents", "energy", "multiplier_columns", "pair_tangents")

STORAGE = {  # whether by blocks -> stages
    True: {"factorise_blocks", "fill_from_blocks", "solve_blocks"},
    "shares": {"solve_sharing", "remove_undecided"},
    False: {"constraint_range", "least_multipliers"},
}
MULTISTEP = {"predict_multistep", "follow_increment", "keep_past"}
STABILISED = {"velocity_gaps", "close_gaps", "fit_velocities"}
METHODS = [  # options of a run, stages that its steps need
    ({}, set()),
    ({"method": "bdf"}, set()),
    ({"method": "bdf", "order": 3}, MULTISTEP | STABILISED),
    ({"stabilised": True}, STABILISED),
    ({"dt": None}, set()),
]


def hinge(mech, b):
    mech.add_rigid("wheel", mass=1.0, inertia=(0.1,) * 3, at=(1, 0, 0))
    mech.revolute("hinge", b, "wheel", axis=(0, 0, 1))
    return "hinge"


@pytest.mark.parametrize("name", ELEMENTS)
def test_a_mechanism_has_the_kernels_of_its_elements_and_no_others(name):
    """Without them it would move as if the elements were not there."""
    mech, a, b = pair()
    assert pack(mech).system.elements.shape == (0, 6)
    ELEMENTS[name](mech, a, b)
    packed = pack(mech)
    ((family, table),) = packed.elements.items()
    kernels = [getattr(family, kernel) for kernel in KERNELS]
    addresses = [0 if kernel is None else kernel.link() for kernel in kernels]
    assert family.name == name
    assert packed.system.elements.tolist() == [[table._address, *addresses]]
    assert addresses[0] and addresses[1]


def test_every_family_of_the_list_is_tried():
    assert [family.name for family in families()] == [*ELEMENTS]


ASKED = {  # stages -> what asks for them
    "coordinate_states": [ELEMENTS["motors"], ELEMENTS["frictions"], ELEMENTS["stops"]],
    "coordinate_states coupling_row coupling_stiffness": [geared_body],
    "rolling_row rolling_stiffness": [
        lambda m, a, b: m.rolling("e", m.ground.marker((0, 0, 0)), b, normal=(0, 0, 1), radius=0.3)
    ],
    "elastic_damping elastic_stiffness": [lambda m, a, b: flexible_body(m)],
    "elastic_damping elastic_stiffness fitted_motion fitted_wrench_stiffness": [
        lambda m, a, b: m.force("e", m.add_flexible("c", truss()).marker("mean"), (1, 0, 0))
    ],
    "elastic_damping elastic_stiffness "
    "bent_coordinates bent_integrals bent_mass bent_damping bent_motion bent_stiffness "
    "bent_wrench_stiffness": [lambda m, a, b: flexible_body(m, stiffened=True)],
}


@pytest.mark.parametrize(("stages", "add"), [(k, add) for k, adds in ASKED.items() for add in adds])
def test_a_mechanism_asks_for_the_stages_of_its_parts(stages, add):
    mech, a, b = pair()
    bare = needed_by(pack(mech).system)
    add(mech, a, b)
    more = needed_by(pack(mech).system) - bare
    assert more - set().union(*STORAGE.values()) == set(stages.split())


def test_a_mechanism_asks_for_the_stages_of_the_way_its_matrices_are_stored():
    packed = pack(rigid_chain(6))
    for kind in (packed, packed.whole()):
        asked = needed_by(kind.system)
        assert STORAGE[kind.by_blocks] <= asked and not STORAGE[not kind.by_blocks] & asked
    assert packed.by_blocks


@pytest.mark.parametrize(("options", "stages"), METHODS)
def test_a_run_asks_for_the_stages_of_its_method(options, stages, monkeypatch):
    steps = []
    monkeypatch.setattr(step_memory, "link", lambda step: (steps.append(step), link(step)))
    rom.simulate(rigid_chain(1), t_end=0.01, **{"dt": 1e-3} | options)
    assert steps and all(needed_by(step) == stages for step in steps)


def test_every_stage_is_asked_for_by_all_mechanisms_or_by_some_part_or_a_method():
    mech, *_ = pair()
    sometimes = set().union(*map(str.split, ASKED), *STORAGE.values(), MULTISTEP, STABILISED)
    sometimes |= {"advance", "keep_pair_tangents", "renew_pair_tangents", "add_renewed"}  # of films
    assert set(STAGE_KERNELS) == set(STAGE_NAMES) == needed_by(pack(mech).system) | sometimes


def test_compiled_code_finds_its_stages_whatever_is_imported_first(tmp_path):
    """It was compiled in a process that had imported them in another order."""
    code = """
import importlib, sys
for name in sys.argv[1:]:
    importlib.import_module(name)
import rom
mech = rom.Mechanism(gravity=(0, 0, -9.81))
ball = mech.add_rigid("ball", mass=1.0, inertia=(0.1,) * 3, at=(1, 0, 0), markers={"p": (-1, 0, 0)})
mech.revolute("hinge", mech.ground.marker((0, 0, 0)), ball.marker("p"), axis=(0, 1, 0))
print(rom.simulate(mech, t_end=0.01, dt=1e-3, progress=False).position("ball")[-1].tolist())
"""
    orders = [(), ("rom.mbs.elements.contact.points", "rom.mbs.equations.linear_solve")]
    said = {python("-c", code, *order, timeout=300, check=True).stdout for order in orders}
    assert len(said) == 1
