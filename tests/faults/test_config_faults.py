"""Damaged description files: a typed error or a mechanism, never a crash."""

import numpy as np
import pytest

from cases.files.damage import damaged, outcome
from cases.files.toml_files import ALL, CRANK, MORE, PENDULUM, SOLID
from rom.config.component import read_component
from rom.config.mechanism import read_mechanism
from rom.errors import ConfigError

MUTANTS = 200


def part(path):
    component = read_component(path)
    assert component.mesh and component.material()


@pytest.mark.filterwarnings("ignore::rom.errors.RomWarning")
@pytest.mark.parametrize(
    ("text", "read"),
    [(SOLID, part), (PENDULUM, lambda path: read_mechanism(path).mechanism()),
     (CRANK, read_mechanism), (ALL, read_mechanism), (MORE, read_mechanism)],
    ids=["component", "pendulum", "crank", "everything", "more"],
)  # fmt: skip
def test_damage_is_refused_or_harmless(text, read, tmp_path):
    path, found = tmp_path / "x.toml", []
    for _, data in damaged(text.encode(), np.random.default_rng(8), MUTANTS):
        path.write_bytes(data)
        found.append(outcome(read, path, memory=None))
    assert sum(isinstance(x, ConfigError) for x in found) > MUTANTS // 4 and None in found
