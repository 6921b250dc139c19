"""Faults from tables, hundreds of them: no crash, no hang, the right class, the culprit by name."""

import sys
from importlib.util import find_spec

import pytest
from generated.case import all_cases, planted
from generated.judge import figures, verdicts
from generated.stock import compile_kernels, fill

LEAST_CASES = 400
LEAST_NAMED = 0.98
CASES = all_cases()
RUN = [name for name, one in CASES.items() if not one.fe or find_spec("dolfinx")]


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    folder = tmp_path_factory.mktemp("faults")
    fill(folder / "stock")
    compile_kernels()
    return verdicts(folder, RUN)


def listed(verdicts):
    return "\n" + "\n".join(f"{v.id}: {v.told}" for v in verdicts)


def test_figures(found, capsys):
    with capsys.disabled():
        sys.stdout.write(f"\n{figures(found)}\nwithout FEniCSx left out: {len(CASES) - len(RUN)}\n")
    assert len(CASES) >= LEAST_CASES and len(found) == len(RUN)
    lost = [v for v in found if not v.survived]
    assert not lost, f"crashes, hangs and foreign exceptions:{listed(lost)}"
    wrong = [v for v in found if not v.right]
    assert not wrong, f"wrong outcomes:{listed(wrong)}"
    open_ended = [v for v in found if not v.ended]
    assert not open_ended, f"messages without a full stop:{listed(open_ended)}"
    spoken = [v for v in found if v.named is not None]
    unnamed = [v for v in spoken if not v.named]
    assert len(unnamed) <= (1 - LEAST_NAMED) * len(spoken), f"unnamed culprits:{listed(unnamed)}"


def test_the_judge_finds_what_is_planted(tmp_path):
    """Whether each survives, is right, and names the culprit; the last one is all of it."""
    fill(tmp_path / "stock")
    found = {v.id[2:]: (v.survived, v.right, v.named) for v in verdicts(tmp_path, list(planted()))}
    assert found == {
        "a crash": (False, False, None),
        "an exit": (False, False, None),
        "a hang": (False, False, None),
        "another exception": (False, False, None),
        "a file that is left": (True, False, True),
        "a file elsewhere": (True, False, None),
        "another class": (True, False, True),
        "another word": (True, True, False),
        "no warning": (True, False, True),
        "a wrong value": (True, False, None),
        "nothing wrong": (True, True, True),
    }
