"""What sweeps shares its points among the workers of an executor, to the same bits."""

import re
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

import rom
from cases.mbs.mechanisms import rotor
from cases.paths import ROOT
from cases.refusals import refuses
from cases.wheels import beam_ring, bladed_ring
from rom.components import linkages, wind
from rom.components.linkages import FiveBar, rod
from rom.errors import ConfigError

RNG = np.random.default_rng(1)
RING = rom.mistuned_wheel(bladed_ring(8), 2)
SWEEP = {"omega": np.linspace(5.9e3, 6.3e3, 400), "engine_order": 2, "damping": 2e-3, "at": [1]}
FIVE = FiveBar(0.7, (rod(2.0, 0.3),) * 2, (rod(1.0, 0.8),) * 2, payload=0.5)
MANY = RNG.normal(0, 0.02, (400, 8))
SWEEPS = {
    "campbell": lambda executor: (
        rom.campbell(
            rotor, np.linspace(0.0, 60.0, 7), frame={"disc": "world"}, executor=executor
        ).eigenvalues
    ),
    "wheel_campbell": lambda executor: (
        rom.wheel_campbell(
            beam_ring(6, 4, EA=1e3, rotary=0.1), 2, 4, speeds=[0.0, 0.05, 0.1], executor=executor
        ).omega
    ),
    "power_curve": lambda executor: wind.power_curve([6.0, 9.0, 14.0], executor=executor)["power"],
    "amplification": lambda executor: RING.amplification(
        MANY, [0.0, 1.0, 0.0], executor=executor, **SWEEP
    ),
    "index_map": lambda executor: linkages.index_map(
        FIVE.inertia, n=24, assembles=FIVE.assembles, executor=executor
    ),
}


@pytest.fixture(scope="module")
def executor():
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        yield pool


@pytest.mark.parametrize("name", SWEEPS)
def test_a_sweep_is_the_same_by_processes(name, executor):
    assert SWEEPS[name](executor).tobytes() == SWEEPS[name](None).tobytes()


def test_what_cannot_be_sent_is_named(executor):
    said = "'_at' cannot be sent to another process"
    refuses(ConfigError, said, rom.campbell, lambda w: rotor(w), [0.0, 1.0], executor=executor)
    refuses(ConfigError, "executor", rom.campbell, rotor, [0.0, 1.0], executor=2)


def test_studies_alone_start_pools():
    starts = re.compile(r"PoolExecutor\(|import multiprocessing")
    files = (ROOT / "rom").rglob("*.py")
    found = [path for path in files if starts.search(path.read_text())]
    assert [path.name for path in found] == ["running.py"]
