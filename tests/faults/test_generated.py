"""Faults from tables, hundreds of them: no crash, no hang, the right class, the culprit by name."""

import random
import sys
from functools import cache
from importlib.util import find_spec

import pytest
from generated.case import CLASSES, all_cases, planted
from generated.judge import figures, verdicts
from generated.stock import compile_kernels, fill

from cases.long import ROM_LONG

pytestmark = pytest.mark.once

LEAST_CASES = 400
LEAST_NAMED = 0.98
CASES = all_cases()
# Classes that share a process.
GROUPS = ("1", "2", "3", "4", "5", "6", "7", "8", "R")
# What of them `make test` runs, fewest of those that start processes; `make long` runs all.
SHARES = dict.fromkeys("1348R", 1 / 6) | dict.fromkeys("567", 1 / 4)
LEAST_SHARE = 1.0 if ROM_LONG else 0.2


def runs_here(one):
    return not one.fe or bool(find_spec("dolfinx"))


def of(group):
    """Names of the cases of some classes, of a sample where they are sampled."""
    can = [name for name, one in CASES.items() if name[0] in group and runs_here(one)]
    size = round(len(can) * (1.0 if ROM_LONG else SHARES.get(group, 1.0)))
    sample = set(random.Random(group).sample(can, size))
    return [name for name in can if name in sample]


@pytest.fixture(scope="module")
def judged(tmp_path_factory):
    """Verdicts on the cases of a group, which run when they are first asked for."""
    folder = tmp_path_factory.mktemp("faults")
    fill(folder / "stock")
    compile_kernels()
    return cache(lambda group: verdicts(folder, of(group)))


def listed(verdicts):
    return "\n" + "\n".join(f"{v.id}: {v.told}" for v in verdicts)


@pytest.mark.parametrize("group", GROUPS)
def test_faults_do_no_harm_and_are_refused(judged, group):
    found = judged(group)
    lost = [v for v in found if not v.survived]
    assert not lost, f"crashes, hangs and foreign exceptions:{listed(lost)}"
    wrong = [v for v in found if not v.right]
    assert not wrong, f"wrong outcomes:{listed(wrong)}"
    open_ended = [v for v in found if not v.ended]
    assert not open_ended, f"messages without a full stop:{listed(open_ended)}"


def test_figures(judged, capsys):
    assert sorted("".join(GROUPS)) == sorted(CLASSES)
    found = [verdict for group in GROUPS for verdict in judged(group)]
    with capsys.disabled():
        sys.stdout.write(f"\n{figures(found)}\nleft out: {len(CASES) - len(found)}\n")
    assert len(CASES) >= LEAST_CASES
    assert len({v.id for v in found}) == len(found)
    assert len(found) >= LEAST_SHARE * sum(map(runs_here, CASES.values()))
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
