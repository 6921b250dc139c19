"""Two geared rotors with 13 published frequencies: beams cut as there, and solids in a mechanism.

Source:
    Rao, Shiau and Chang, Mech. Mach. Theory 33 (1998) 761; frequencies at 1500 turns a minute, of
    seven beam elements, from Friswell, Penny, Garvey and Lees, Dynamics of Rotating Machines
    (2010). Finer beams bend more easily: the lowest frequency falls by a twelfth.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.paths import ROOT
from rom.components.gear_mesh import GearPair
from rom.components.transmission import Disc, Shaft

PUBLISHED = (11.641, 12.284, 17.268, 18.458, 23.956, 37.681, 49.889, 50.861, 56.248, 57.752,
             59.188, 63.113, 74.203)  # fmt: skip
E, G, RHO = 207e9, 79.5e9, 7800.0
ALPHA, MESH, OIL, THRUST = np.radians(22.5), 1e8, 3e3, 1e8
TEETH, RB, SPEED = (328, 23), (0.5086, 0.03567), 50 * np.pi
SPINS = (SPEED, -SPEED * TEETH[0] / TEETH[1])
# pieces of both shafts; discs by node, with mass and inertia across and about; bearings by node
LENGTHS = (0.1, 4.24, 1.16, 0.3), (0.3, 5.0, 0.1)
DIAMETERS = (0.3, 0.3, 0.22, 0.22), (0.15, 0.15, 0.15)
DISCS = (
    {1: (525.7, 16.1, 32.2), 2: (116.04, 3.115, 6.23), 4: (726.4, 56.95, 113.9)},
    {2: (7.45, 0.0745, 0.149), 0: (5.0, 0.002, 0.004)},
)
BEARINGS = (dict.fromkeys((0, 3), (183.9e6, 200.4e6)), dict.fromkeys((1, 3), (10.1e6, 41.6e6)))
WHEELS = (4, 0)  # their nodes


def beams(n):
    """Frequencies [Hz] and damping ratios of shafts of n elements a piece, teeth as a spring."""
    shafts = [
        Shaft(
            np.cumsum([0.0, *np.repeat(np.divide(L, n), n)]), np.repeat(d, n),
            [Disc(n * node, *disc) for node, disc in discs.items()], (E, E / (2 * G) - 1, RHO),
        )
        for L, d, discs in zip(LENGTHS, DIAMETERS, DISCS, strict=True)
    ]  # fmt: skip
    at = np.cumsum([0, *(shaft.n for shaft in shafts)])
    M, K, C = np.zeros((3, at[-1], at[-1]))
    closes = np.zeros(at[-1])
    for k, shaft in enumerate(shafts):
        own = slice(at[k], at[k + 1])
        M[own, own], K[own, own], gyroscopic = shaft.matrices()
        C[own, own] = SPINS[k] * gyroscopic
        for node, stiffness in BEARINGS[k].items():
            i = at[k] + 6 * n * node + np.arange(2)
            K[i, i] += stiffness
            C[i, i] += OIL
        i = at[k] + 6 * n * min(BEARINGS[k]) + 2
        K[i, i] += THRUST
        i = at[k] + 6 * n * WHEELS[k]
        side = 1 - 2 * k
        closes[[i, i + 1, i + 5]] = side * np.sin(ALPHA), side * np.cos(ALPHA), RB[k]
    K += MESH * np.outer(closes, closes)
    one = np.eye(at[-1])
    root = np.linalg.eigvals(np.block([[0 * M, one], [-np.linalg.solve(M, x) for x in (K, C)]]))
    root = root[root.imag > 10.0]
    root = root[np.argsort(root.imag)]
    return root.imag / (2 * np.pi), -root.real / abs(root)


def without_axial(found):
    """Frequencies [Hz] and damping ratios of what bends and turns: axial motions are not damped."""
    f, damping = found
    return f[damping > 1e-6][:13], damping[damping > 1e-6][:13]


def test_beams_cut_as_there_have_the_published_frequencies():
    assert_allclose(without_axial(beams(1))[0], PUBLISHED, atol=6e-4)


def solid(L, d, z_a, z_b, lc):
    steel = rom.Material(E=E, nu=E / (2 * G) - 1, rho=RHO)
    kinds = dict.fromkeys(("journal_a", "journal_b", "end_a", "end_b"), "rbe3")
    places = {"L": L, "d": d, "z_a": z_a, "z_w": (z_a + z_b) / 2, "z_b": z_b}
    model = rom.fe.model(ROOT / "meshes" / "gear_shaft.geo", material=steel, order=2, degree=2,
                         parameters={**places, "l_j": 0.02, "b": 0.02, "lc": lc})  # fmt: skip
    return rom.reduce(model, method=rom.CraigBampton(14), interfaces=kinds,
                      reference="mean-axis", certify=False)  # fmt: skip


def machine(solids, stiffness):
    """The mechanism: shafts that spin in frames which do not, teeth under a torque of 1 N m."""
    pair = GearPair(TEETH, 2 * RB[0] / (TEETH[0] * np.cos(ALPHA)), 0.02, pressure_angle=ALPHA)
    far, z = pair.distance, np.array([0.0, 0.0, 1.0])
    mech = rom.Mechanism()
    a = mech.add_flexible("generator", solids[0], spin=SPINS[0] * z).marker
    b = mech.add_flexible("end", solids[1], at=(0, 0, 4.34), spin=SPINS[0] * z).marker
    c = mech.add_flexible("turbine", solids[2], at=(far, 0, 5.8), spin=SPINS[1] * z).marker
    mech.fixed("step", a("end_b"), b("end_a"))
    places = (  # markers of the nodes of both shafts
        (a("end_a"), a("journal_a"), b("end_a"), b("journal_b"), b("end_b")),
        (c("end_a"), c("journal_a"), c("journal_b"), c("end_b")),
    )
    for k, ends in enumerate(places):
        for node, (mass, across, about) in DISCS[k].items():
            disc = mech.add_rigid(f"disc {k} {node}", mass=mass, inertia=(across, across, about),
                                  at=mech.design_point(ends[node]), spin=SPINS[k] * z,
                                  markers={"middle": (0, 0, 0)})  # fmt: skip
            mech.fixed(f"seat {k} {node}", ends[node], disc.marker("middle"))
        for node, across in BEARINGS[k].items():
            thrust = THRUST if node == min(BEARINGS[k]) else 0.0
            ground = mech.ground.marker(mech.design_point(ends[node]))
            mech.bushing(f"bearing {k} {node}", ground, ends[node],
                         stiffness=(*across, thrust, 0, 0, 0),
                         damping=(OIL, OIL, 0, 0, 0, 0))  # fmt: skip
    wheels = [mech.part(name).marker("middle") for name in ("disc 0 4", "disc 1 0")]
    mech.gear_mesh("teeth", *wheels, axis=z, pair=pair, stiffness=stiffness, entry=0.0)
    twist = (0, 0, 0, 0, 0, 100)
    mech.bushing("drive", mech.ground.marker((0, 0, 0)), places[0][0], stiffness=twist)
    mech.torque("load", wheels[1], RB[1] / RB[0] * z)
    return mech


@pytest.mark.fenicsx
def test_solids_of_a_mechanism_have_the_frequencies_and_damping_of_fine_beams():
    """Of teeth in narrow wheels, as stiff as all lines of contact together."""
    # the generator's shaft, its thinner end and the turbine's shaft
    sizes = (4.34, 0.3, 0.1, 4.2, 0.11), (1.46, 0.22, 0.2, 1.16, 0.08), (5.4, 0.15, 0.3, 5.3, 0.06)
    solids = [solid(*x) for x in sizes]
    mech = machine(solids, 1e10)
    lines = rom.mbs.tooth_loads(rom.mbs.snapshot(mech, rom.equilibrium(mech)), "teeth")[0].length
    mech = machine(solids, MESH / lines.sum())
    modes = rom.linearize(mech, rom.equilibrium(mech))
    above = modes.frequencies > 5.0
    found = without_axial((modes.frequencies[above], modes.damping_ratios[above]))
    expected = without_axial(beams(8))
    assert_allclose(found[0], expected[0], rtol=6e-4)
    assert_allclose(found[1], expected[1], rtol=0.02, atol=1e-5)
    assert modes.stable
