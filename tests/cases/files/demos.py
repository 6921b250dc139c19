"""The demos, how each of them runs, what its numbers must be, and what it leaves behind.

In `make test` each that is not of `LONG_DEMOS` runs; in `make long` all do, and all with a mesh
under mpirun, too.
"""

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
LEFT_BEHIND = {  # by demos that leave other things than one picture of their name
    "demo_assembly": {"assembly_errors.png"},
    "demo_beam": {"beam_modes.png", "beam_frequencies.png"},
    "demo_bladed_disk": {"bladed_disk_modes.png", "bladed_disk_diagrams.png"},
    "demo_forming": {"forming.png", "upsetting.gif"},
    "demo_hand": {"hand.png", "hand_control.png", "hand_grasp.gif", "hand_grasp.png"},
    "demo_exchange": {
        "beam.SID_FEM", "beam.csv", "beam.dat", "beam.dmig", "beam.fem", "beam.glb", "beam.inp",
        "beam.mat", "beam.op4", "beam.py", "beam.vtu", "exchange.png",
    },
    "demo_isotropy": {"isotropy.png", "isotropy_compared.png"},
    "demo_large_mesh": {"housing_mesh.png", "housing_modes.png"},
    "demo_masonry": {"masonry.gif", "masonry.png", "masonry_vault.png"},
    "demo_oil_inlet": {"oil_inlet.gif", "oil_inlet.png", "oil_inlet_static.png"},
    "demo_reference_conditions": {
        "reference_conditions.png", "reference_resonance.png", "reference_statics.png",
    },
    "demo_planetary": {"planetary.png", "planetary_motion.png"},
    "demo_rockfall": {"rockfall.gif", "rockfall.png", "rockfall_capacity.png"},
    "demo_rotating_blade": {"rotating_beam.png", "blade_campbell.png"},
    "demo_rotor": {"rotor_modes.png", "rotor_whirl.png"},
    "demo_robot_arm": {"robot_arm.png", "robot_arm.gif"},
    "demo_satellite": {"satellite.png", "satellite.gif"},
    "demo_whole_turbine": {
        "turbine_campbell.png", "whole_turbine.gif", "whole_turbine.png",
    },
    "demo_sheet": {"sheet.png", "strip.png", "taylor_bar.gif"},
    "demo_slider_crank": {
        "crank_mesh.png", "frames.png", "instants.png", "motion.png", "report.html",
        "rod.rom.npz", "rod.vtu", "rod_frequencies.png", "rod_mesh.png", "rod_modes.png",
        "slider_crank.gif",
    },
    "demo_wind_power": {"wind_power.png", "wind_turbine_hub.png"},
    "demo_wind_turbine": {
        "wind_turbine.png", "wind_turbine_campbell.png", "wind_turbine_shapes.png",
    },
}  # fmt: skip


def check(demo, results, folder):
    """Four numbers or more, each as expected within its tolerance; the files, and no others."""
    assert len(results) >= 4
    for name, (value, expected, tolerance) in results.items():
        assert value == pytest.approx(expected, rel=tolerance, abs=0), (name, value, expected)
    picture = f"{demo.stem.removeprefix('demo_')}.png"
    assert {path.name for path in folder.iterdir()} == LEFT_BEHIND.get(demo.stem, {picture})
