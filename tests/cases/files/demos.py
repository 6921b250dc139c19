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
        "assembly beam bent_blade best_matching bladed_disk bolted_frame compressor_blade exchange "
        "flexure forming hand isotropy large_deflection large_mesh lost_tip masonry mistuning "
        "oil_inlet parameters pendulum_chain periodic planetary robot_arm rockfall rolling_wheel "
        "rotating_blade rotor satellite sheet slider_crank snap_through spin_up transmission "
        "two_stage updating virtual_sensing whole_turbine wind_power wind_turbine"
    ).split()
}
FILES = """
assembly: assembly_errors.png
beam: beam_modes.png beam_frequencies.png
bladed_disk: bladed_disk_modes.png bladed_disk_diagrams.png
forming: forming.png upsetting.gif
hand: hand.png hand_control.png hand_grasp.gif hand_grasp.png
exchange: beam.SID_FEM beam.csv beam.dat beam.dmig beam.fem beam.glb beam.inp beam.mat beam.op4
  beam.py beam.vtu exchange.png
isotropy: isotropy.png isotropy_compared.png
large_mesh: housing_mesh.png housing_modes.png
masonry: masonry.gif masonry.png masonry_vault.png
oil_inlet: oil_inlet.gif oil_inlet.png oil_inlet_static.png
reference_conditions: reference_conditions.png reference_resonance.png reference_statics.png
planetary: planetary.png planetary_motion.png
rockfall: rockfall.gif rockfall.png rockfall_capacity.png
rotating_blade: rotating_beam.png blade_campbell.png
rotor: rotor_modes.png rotor_whirl.png
robot_arm: robot_arm.png robot_arm.gif
satellite: satellite.png satellite.gif
whole_turbine: turbine_campbell.png whole_turbine.gif whole_turbine.png
sheet: sheet.png strip.png taylor_bar.gif
slider_crank: crank_mesh.png frames.png instants.png motion.png report.html rod.rom.npz rod.vtu
  rod_frequencies.png rod_mesh.png rod_modes.png slider_crank.gif
wind_power: wind_power.png wind_turbine_hub.png
wind_turbine: wind_turbine.png wind_turbine_campbell.png wind_turbine_shapes.png
"""  # of demos that leave other things than one picture of their name
LEFT_BEHIND = {
    f"demo_{name}": set(files.split())
    for name, files in re.findall(r"^(\w+): (.+(?:\n  .+)*)", FILES, re.M)
}


def check(demo, results, folder):
    """Four numbers or more, each as expected within its tolerance; the files, and no others."""
    assert len(results) >= 4
    for name, (value, expected, tolerance) in results.items():
        assert value == pytest.approx(expected, rel=tolerance, abs=0), (name, value, expected)
    picture = f"{demo.stem.removeprefix('demo_')}.png"
    assert {path.name for path in folder.iterdir()} == LEFT_BEHIND.get(demo.stem, {picture})
