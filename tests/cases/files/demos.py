"""The demos, how each of them runs, what its numbers must be, and what it leaves behind.

In `make test` each that is not of `LONG_DEMOS` runs; in `make long` all do, and all with a mesh
under mpirun, too.
"""

import re

import pytest

from cases.paths import ROOT

DEMOS = sorted((ROOT / "demos").glob("demo_*.py"))
MESHED = [path for path in DEMOS if "rom.fe" in path.read_text()]
# about ten seconds each and more, of what has tests of its own
LONG_DEMOS = {
    f"demo_{name}"
    for name in (
        "assembly barc beam bent_blade best_matching bladed_disk bladed_rotor bolted_frame "
        "compressor_blade exchange flexible_arm flexure forming garteur hand isotropy "
        "large_deflection large_mesh lost_tip masonry measured_arches measured_frames "
        "measured_rods mistuning oil_inlet parameters pendulum_chain periodic planetary "
        "robot_arm rockfall rolling_wheel rotating_blade rotor satellite sheet slider_crank "
        "snap_through spin_up study superelement transmission two_stage updating "
        "virtual_sensing whole_turbine wind_power wind_turbine"
    ).split()
}
OUTPUT = re.compile(r'\bout / "([\w.]+)"')  # what a demo names in the folder of its results
OF_A_TABLE = {"demo_exchange": {f"beam.{ending}" for ending in "fem inp mat op4 py vtu".split()}}


def check(demo, results, folder):
    """Four numbers or more, each as expected; the files that it names, and no others."""
    assert len(results) >= 4
    for name, (value, expected, tolerance) in results.items():
        assert value == pytest.approx(expected, rel=tolerance, abs=0), (name, value, expected)
    named = {*OUTPUT.findall(demo.read_text()), *OF_A_TABLE.get(demo.stem, ())}
    assert {path.name for path in folder.iterdir()} == named
