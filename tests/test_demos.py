"""Every demo runs and ends in numbers that agree with what is known."""

import runpy
import sys
from pathlib import Path

import pytest

pytest.importorskip("dolfinx", reason="demos start from finite elements")
pytestmark = [pytest.mark.fenicsx, pytest.mark.slow]
DEMOS = sorted((Path(__file__).parents[1] / "demos").glob("demo_*.py"))
LEFT_BEHIND = {
    "demo_assembly": {"assembly_errors.png"},
    "demo_beam": {"beam_modes.png", "beam_frequencies.png"},
    "demo_bent_blade": {"bent_blade.png"},
    "demo_best_matching": {"best_matching.png"},
    "demo_bladed_disk": {"bladed_disk_modes.png", "bladed_disk_diagrams.png"},
    "demo_compressor_blade": {"compressor_blade.png"},
    "demo_hand": {"hand.png", "hand_control.png"},
    "demo_exchange": {
        "beam.SID_FEM", "beam.csv", "beam.dat", "beam.dmig", "beam.fem", "beam.glb", "beam.inp",
        "beam.mat", "beam.op4", "beam.py", "beam.vtu",
    },
    "demo_isotropy": {"isotropy.png"},
    "demo_large_mesh": {"housing_mesh.png", "housing_modes.png"},
    "demo_lost_tip": {"lost_tip.png"},
    "demo_masonry": {"masonry.png"},
    "demo_mistuning": {"mistuning.png"},
    "demo_parameters": {"parameters.png"},
    "demo_reference_conditions": {"reference_conditions.png"},
    "demo_pendulum_chain": {"pendulum_chain.png"},
    "demo_rockfall": {"rockfall.png"},
    "demo_rotating_blade": {"rotating_beam.png", "blade_campbell.png"},
    "demo_rotor": {"rotor_modes.png", "rotor_whirl.png"},
    "demo_robot_arm": {"robot_arm.png", "robot_arm.gif"},
    "demo_satellite": {"satellite.png", "satellite.gif"},
    "demo_rolling_wheel": {"rolling_wheel.png"},
    "demo_updating": {"updating.png"},
    "demo_whole_turbine": {"whole_turbine.gif", "whole_turbine.png"},
    "demo_sheet": {"sheet.png", "taylor_bar.gif"},
    "demo_slider_crank": {
        "crank_mesh.png", "frames.png", "instants.png", "motion.png", "report.html",
        "rod.rom.npz", "rod.vtu", "rod_frequencies.png", "rod_mesh.png", "rod_modes.png",
        "slider_crank.gif",
    },
    "demo_spin_up": {"spin_up.png"},
    "demo_wind_turbine": {
        "wind_turbine.png", "wind_turbine_campbell.png", "wind_turbine_shapes.png",
    },
    "demo_transmission": {"transmission.png", "transmission_fields.png"},
}  # fmt: skip


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
@pytest.mark.parametrize("demo", DEMOS, ids=lambda path: path.stem)
def test_demo_ends_in_the_numbers_expected(demo, tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", [str(demo), "--quiet", "--out", str(tmp_path)])
    results = runpy.run_path(str(demo), run_name="__main__")["results"]
    assert len(results) >= 4
    for name, (value, expected, tolerance) in results.items():
        assert value == pytest.approx(expected, rel=tolerance, abs=0), name
    assert {path.name for path in tmp_path.iterdir()} == LEFT_BEHIND[demo.stem]
