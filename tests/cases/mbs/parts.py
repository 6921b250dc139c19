"""A body on a guide or a hinge, a rod held, a law that slips; wrong calls on a mechanism."""

import numpy as np
import pytest

import rom
from rom.components.cosserat import body, straight

ORIGIN = (0.0, 0.0, 0.0)
X, Y, Z = np.eye(3)
RECORD = {"outputs": ["slip"], "energy": True}  # what the law writes beside its forces


def on_guide(mech, name="mass", *, mass=1.0, at=ORIGIN, axis=X, base=ORIGIN, guide="guide", **more):
    """Centre of a body that slides along an axis, on the ground at a place or on a marker."""
    centre = mech.add_rigid(name, mass=mass, inertia=(1, 1, 1), at=at, **more).marker(ORIGIN)
    base = mech.ground.marker(base) if np.ndim(base) else base
    mech.prismatic(guide, base, centre, axis=axis)
    return centre


def on_hinge(mech, at, name="bob", *, mass=2.0, inertia, axis=Y, pivot=None, **more):
    """A body on a hinge through the origin: its "pin" there, "c" its centre of mass."""
    markers = {"pin": -np.asarray(at), "c": ORIGIN}
    part = mech.add_rigid(name, mass=mass, inertia=inertia, at=at, markers=markers, **more)
    mech.revolute("hinge", pivot or mech.ground.marker(ORIGIN), part.marker("pin"), axis=axis)
    return part


def on_axle(mech, name="wheel", *, inertia=(1, 1, 0.5), axle="axle", axis=Z, **more):
    """Centre of a wheel in the origin, or at a place, that turns about an axis on the ground."""
    given = {"mass": 1.0, "at": ORIGIN} | more
    centre = mech.add_rigid(name, inertia=inertia, **given).marker(ORIGIN)
    mech.revolute(axle, mech.ground.marker(given["at"]), centre, axis=axis)
    return centre


def turned(angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def slender(mech, name, start, end, mass=1.0, **motion):
    """A slender uniform rod in the xy plane with a marker at each end."""
    start, end = np.append(start, 0.0), np.append(end, 0.0)
    length = np.linalg.norm(end - start)
    J, half = mass * length**2 / 12, 0.5 * length * X
    return mech.add_rigid(
        name, mass=mass, inertia=(1e-3 * J, J, J), at=0.5 * (start + end),
        orientation=turned(np.arctan2(*(end - start)[1::-1])),
        markers={"a": -half, "b": half}, **motion,
    )  # fmt: skip


def below(angle, length=1.0):
    """A place at an angle from straight below the origin, about y."""
    return length * np.array([np.sin(angle), 0, -np.cos(angle)])


def held_rod(n, *, joint="fixed", gravity=ORIGIN, on=None, axis=None, length=1.0, **section):
    """A mechanism and an upright rod of n pieces in it, its start joined to the ground.

    Or to (mechanism, marker) that it stands on, or to nothing; the section is that of `straight`.
    """
    mech, base = on or (rom.Mechanism(gravity=gravity), None)
    rod = mech.add_nonlinear("rod", body(straight(length, n, **section)))
    if joint:
        ends = base or mech.ground.marker(ORIGIN), rod.marker("start")
        getattr(mech, joint)("hook", *ends, **({} if axis is None else {"axis": axis}))
    return mech, rod


def slipping(t, parameters, motion, memory, out):
    """A spring in a row with dry friction along x; it remembers where the friction stands."""
    k, limit = parameters
    x = motion.position[1, 0] - motion.position[0, 0]
    pull = k * (x - memory[0])
    slip = 0.0
    if abs(pull) > limit:
        slip = (abs(pull) - limit) / k * np.sign(pull)
        pull = np.sign(pull) * limit
        out.lost[0] = abs(pull * (motion.velocity[1, 0] - motion.velocity[0, 0]))
    out.memory[0] = memory[0] + slip
    out.force[0, 0], out.force[1, 0] = pull, -pull
    out.energy[0] = 0.5 * pull**2 / k
    out.outputs[0] = slip


def boxed():
    """A mechanism of one box, a place of the ground, and the centre of the box."""
    mech = rom.Mechanism()
    box = mech.add_rigid("box", mass=1, inertia=(1, 1, 1), at=ORIGIN)
    return mech, mech.ground.marker(ORIGIN), box.marker(ORIGIN)


def refused_on(build, rows, error=rom.ConfigError):
    """A test that each call names its culprit, and leaves a mechanism as it was.

    Rows are {what is wrong: (call, words of the message)}, the class between where it is another.
    """

    @pytest.mark.parametrize("case", rows)
    def test(case):
        call, *kind, words = rows[case]
        mech, *more = build()
        entries = mech.parts, mech.joints, mech.drives, mech.elements
        before = [set(x) for x in entries]
        with pytest.raises(*kind or [error]) as caught:
            call(mech, *more)
        assert words in f"{caught.value} {caught.value.where}"
        assert [set(x) for x in entries] == before

    return test
