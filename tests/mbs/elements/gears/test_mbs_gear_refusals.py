"""Meshes of files; wheels that do not mesh are refused with their names where the mesh is."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from rom.components.gear_mesh import RackPair
from rom.errors import ConfigError, ModelError

SIZES = {"teeth": [26, 40], "module": 4e-3, "width": 0.03}
MESH = {"axis": [0, 0, 1], "stiffness": 1.3e10}
WRONG = {  # sizes of the pair, keys of the mesh, where the other wheel stands [m], and the message
    "wheels too far apart for their teeth": (
        {"centre_distance": 0.135}, {}, 0.135, r"contact is lost: .* ratio of 0\.978"),
    "wheels that do not reach each other": (
        {"centre_distance": 0.2}, {}, 0.2, "contact is lost: .* ratio of -"),
    "wheels too close for their teeth": (
        {"centre_distance": 0.1319}, {}, 0.1319,
        r"backlash is closed: at a centre distance of 131\.9000 mm .* From 132\.0000 mm"),
    "wheels inside each other": (
        {"centre_distance": 0.1}, {}, 0.1,
        r"at a centre distance of 100\.0000 mm the base circles .* no common tangent"),
    "another ratio than the distance": (
        {"teeth": [26, 42]}, {}, 0.132, "'m' stand 132 mm apart, those of its pair 136 mm"),
    "undercut": ({"teeth": [12, 40]}, {}, 0.104, r"pinion are undercut: .* at least 0\.298 mod"),
    "undercut gear": ({"teeth": [26, 12]}, {}, 0.076, "teeth of the gear are undercut"),
    "interference": ({"teeth": [20, -62]}, {}, 0.084, "interfere: tips of the gear .* from -"),
    "interference beside the path": (
        {"teeth": [40, -46]}, {}, 0.012, "interfere: away from the path .* 40.* through .* 46"),
    "ring without involutes": ({"teeth": [24, -30]}, {}, 0.012, "below its base circle, where no"),
    "pointed": ({"teeth": [18, 40], "shift": [1.2, 0]}, {}, 0.12, "teeth of the pinion are point"),
    "hand": ({"helix": 0.3, "gear_helix": 0.3}, {}, 0.138,
             r"helix 17\.19 degrees does not mesh with a pinion of 17\.19 .*-17\.19 degrees"),
    "hand in a ring": ({"teeth": [24, -72], "helix": 0.3, "gear_helix": -0.3}, {}, 0.1,
                       r"in a ring gear they are the same. The gear here needs 17\.19 degrees"),
    "ring smaller than its pinion": ({"teeth": [26, -20]}, {}, 0.01, "no pinion of 26.* turns"),
    "ring as large as its pinion": ({"teeth": [40, -40]}, {}, 0.01, "no pinion of 40.* turns"),
    "ring as pinion": ({"teeth": [-72, 24]}, {}, 0.1, "no pinion of -72.* teeth"),
    "half a tooth": ({"teeth": [26.5, 40]}, {}, 0.133, "26.5, 40.* teeth, needed are whole"),
    "few teeth": ({"teeth": [3, 40]}, {}, 0.1, r"no gears have \(3.*, 40.*\) teeth"),
    "degrees": ({"helix": 15.0}, {}, 0.1, "helix 15.0 and pressure angle .* must be in radians"),
    "faces": ({}, {}, (0.132, 0, 0.01), "faces of mesh 'm' are 10 mm beside each other"),
    "axis": ({}, {"axis": [1, 0, 0]}, 0.132, "'m' stand 0 mm apart"),
    "pull": ({}, {"stiffness": -1.0}, 0.132, r"m\b.*stiffness = -1.* must be positive"),
    "friction": ({}, {"friction": 0.1}, 0.132, "mesh 'm' has friction, but no transition_speed"),
    "rack too close": ({"teeth": [26, 0], "centre_distance": 0.0519}, {}, 0.0519,
                       r"backlash is closed: 51\.9000 mm .*From 52\.0000 mm"),
    "rack too far": ({"teeth": [26, 0], "centre_distance": 0.057}, {}, 0.057, "contact is lost"),
    "undercut pinion of a rack": ({"teeth": [12, 0]}, {}, 0.024, "pinion are undercut"),
    "ring on a rack": ({"teeth": [-26, 0]}, {}, 0.052, "no pinion of -26.* turns on a rack.*outsi"),
    "half a tooth on a rack": ({"teeth": [26.5, 0]}, {}, 0.053, r"teeth = 26\.5 must be"),
    "hand of a rack": ({"teeth": [26, 0], "helix": 0.3, "gear_helix": 0.3}, {}, 0.0544,
                       r"rack of helix 17\.19 degrees does not mesh.*opposite: -17\.19 degrees"),
    "shift of a rack": ({"teeth": [26, 0], "shift": [0.1, 0.2]}, {}, 0.0524,
                        r"rack of 'm' has a profile shift of 0\.2.*centre_dis"),
    "steep rack": ({"teeth": [26, 0], "pressure_angle": 0.67}, {}, 0.052, "the rack are pointed"),
    "rack beside its pinion": ({"teeth": [26, 0]}, {}, (0.052, 0.03, 0),
                               "marker of a rack"),
    "rack along the axis": ({"teeth": [26, 0]}, {"axis": [1, 0, 0]}, 0.052, "'m' stand 0 mm apart"),
}  # fmt: skip


FILE = """
[simulation]
t_end = 1e-3
[bodies.a]
mass = 1
inertia = [1, 1, 1]
at = [0, 0, 0]
markers = {{ p = [0, 0, 0] }}
[gear_meshes.m]
between = ["a.p", {{ ground = {where} }}]
{mesh}
[gear_meshes.m.pair]
{pair}
"""


def written(folder, where, *tables):
    mesh, pair = ("\n".join(f"{key} = {value}" for key, value in x.items()) for x in tables)
    path = folder / "m.toml"
    path.write_text(FILE.format(where=where, mesh=mesh, pair=pair))
    return path


@pytest.mark.parametrize("case", WRONG)
def test_files_with_what_does_not_mesh_are_refused_where_the_mesh_is(case, tmp_path):
    sizes, more, where, message = WRONG[case]
    place = [where, 0, 0] if np.isscalar(where) else list(where)
    path = written(tmp_path, place, MESH | more, SIZES | sizes)
    with pytest.raises((ConfigError, ModelError), match=f"(?s){message}") as refused:
        rom.read_mechanism(path).mechanism()
    key = re.search(r"gear_meshes\.m\.(\w+) = ", str(refused.value))  # one read alone
    begin = key[1] if key else "[gear_meshes.m]"
    texts = enumerate(path.read_text().split("\n"), 1)
    line = next(k for k, text in texts if text.startswith(begin))
    assert f"m.toml:{line}:" in str(refused.value)


def test_a_rack_does_not_spin():
    pair, mech = RackPair(26, 4e-3, 0.03), rom.Mechanism()
    pinion = mech.add_rigid("a", mass=1.0, inertia=(1.0,) * 3, at=(0, 0, 0))
    rack = mech.add_rigid("b", mass=1.0, inertia=(1.0,) * 3, at=(pair.distance, 0, 0),
                          spin=(0, 0, 3.0))  # fmt: skip
    with pytest.raises(ConfigError, match="the rack of 'm' spins at 3 rad/s"):
        mech.gear_mesh("m", pinion.marker((0, 0, 0)), rack.marker((0, 0, 0)), pair=pair, **MESH)


def test_files_give_a_rack_no_teeth(tmp_path):
    sizes = {"teeth": [26, 0], "module": '"4 mm"', "width": '"3 cm"', "shift": [0.1, 0]}
    path = written(tmp_path, '["52.4 mm", 0, 0]', MESH | {"stiffness": '"13 GPa"'}, sizes)
    mesh = rom.read_mechanism(path).mechanism().gear_meshes["m"]
    assert mesh.pair == RackPair(26, 4e-3, 0.03, shift=0.1)


FLANKS = """
[gear_meshes.m.correction]
pinion_map = "pinion.csv"
gear_back_map = "gear.csv"
gear_pitch = [PITCH]
run_out = ["2 um", "3 um"]
run_out_direction = [0.1, 0.2]
"""


def test_files_have_all_that_teeth_may_be(tmp_path):
    (tmp_path / "pinion.csv").write_text("1e-6,2e-6\n3e-6,4e-6\n")
    (tmp_path / "gear.csv").write_text("1e-6\n\n" * 40)
    sizes = SIZES | {"module": '"4 mm"', "width": '"30 mm"', "helix": 0.0, "gear_helix": 0.0}
    more = {"stiffness": '["12 GPa", "13 GPa"]', "coupling": '"4 mm"', "conservative": "true"}
    more["hertz"] = '{ depths = ["4 mm", "3 mm"], nu = 0.28 }'
    path = written(tmp_path, '["132 mm", 0, 0]', MESH | more, sizes)
    pitch = ", ".join(f'"{k % 5} um"' for k in range(40))
    path.write_text(path.read_text() + FLANKS.replace("PITCH", pitch))
    mesh = rom.read_mechanism(path).mechanism().gear_meshes["m"]
    assert mesh.numbers[3:] == pytest.approx((1.0, 4e-3, (1 - 0.28**2) / (np.pi * 206e9)))
    assert_allclose(mesh.stiffness, (12e9, 13e9))
    assert_allclose(mesh.hertz.depths, (4e-3, 3e-3))
    flanks = mesh.correction
    assert_allclose(flanks.maps[0], [[[1e-6, 2e-6], [3e-6, 4e-6]]])
    assert_allclose(flanks.back_maps[1], np.full((40, 1, 1), 1e-6))
    assert flanks.maps[1] is None and flanks.back_maps[0] is None
    assert_allclose(flanks.pitch[1], 1e-6 * (np.arange(40) % 5))
    assert_allclose(flanks.run_out, ((2e-6, 0.1), (3e-6, 0.2)))
