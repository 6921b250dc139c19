"""Damaged description files: a typed error or a mechanism, never a crash."""

import random

import pytest

import rom
from cases.files.toml_files import ALL, CRANK, MORE, PENDULUM, SOLID
from rom.config.component import read_component
from rom.config.mechanism import read_mechanism

MUTANTS = 200


def mutants(text, seed):
    """Bytes flipped, cut off, put in, and lines doubled."""
    chance, data = random.Random(seed), text.encode()
    for _ in range(MUTANTS):
        k = chance.randrange(len(data))
        way = chance.choice(("flip", "cut", "insert", "double"))
        if way == "flip":
            yield data[:k] + bytes([data[k] ^ (1 << chance.randrange(8))]) + data[k + 1 :]
        elif way == "cut":
            yield data[:k]
        elif way == "insert":
            yield data[:k] + chance.randbytes(chance.randrange(1, 9)) + data[k:]
        else:
            lines = data.splitlines(keepends=True)
            n = chance.randrange(len(lines))
            yield b"".join([*lines[: n + 1], *lines[n:]])


def outcome(path, data, read):
    """The name of the error, or None; everything that is no RomError ends the test."""
    path.write_bytes(data)
    try:
        read(path)
    except rom.RomError as error:
        assert error.exit_code in (2, 3, 4) and error.message and str(path.name) in str(error)
        return type(error).__name__
    return None


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
    found = [outcome(tmp_path / "x.toml", data, read) for data in mutants(text, seed=8)]
    assert found.count("ConfigError") > MUTANTS // 4 and None in found


def test_a_key_twice_is_told_with_its_line(tmp_path):
    """Spec A03: no TOMLDecodeError."""
    (tmp_path / "x.toml").write_text(SOLID + 'rho = "1 kg/m^3"\n')
    with pytest.raises(rom.errors.ConfigError) as refused:
        read_component(tmp_path / "x.toml")
    assert refused.value.where == f"{tmp_path / 'x.toml'}:12"
    assert "'material.rho' is given twice, in lines 11 and 12" in refused.value.message
