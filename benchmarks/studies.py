"""Studies of hundreds of runs: what the second core brings, and what hands over and keeps cost.

Wall clock, as several processes share the work; each case is measured twice and the faster one
counts. The same slider-cranks, by Exudyn's variation of parameters on as many processes.
"""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from benchmarks.measures import RADIUS, SHORT, STEPS, T_END, crank, short
from benchmarks.peers.compare import answer_of, interpreter
from benchmarks.peers.mechanisms import slider_crank
from benchmarks.peers.motion import SCRIPT_FILE, Run, reduced, rod, save_for_exudyn, with_all_nodes
from benchmarks.timing import Row
from rom.components.studies.study import Study, study
from rom.io.native import load, save
from rom.process.child import scratch

WORKERS = 2
SPEEDS = 50.0, 70.0  # of cranks [rad/s]
TAKEN = 2  # times each case is measured


def measured(cranks: int = 500, peers: int = 40, shorts: int = 10_000) -> Iterator[Row]:
    """Case, quantity, value, unit and aim of each figure.

    Args:
        cranks: samples of the study of slider-cranks.
        peers: of these, how many are moved by Exudyn, too; 0 for none.
        shorts: samples of a millisecond each.
    """
    with scratch("studies") as folder:
        file, kept = str(folder / "rod.rom.npz"), folder / "kept.study"
        model = with_all_nodes(rod(0.006))
        save(reduced(model), file)
        samples = {"speed": np.linspace(*SPEEDS, cranks), "file": np.full(cranks, file)}
        case = f"{cranks} slider-cranks of {STEPS} steps"
        first, _ = clocked(lambda: study(crank, few(samples, 1), workers=1, progress=False), 1)
        yield "one slider-crank", "a worker's start and first motion", first, "s", "below 1.5"
        here, _ = clocked(lambda: [crank(float(w), file) for w in samples["speed"]])
        one, _ = clocked(lambda: studied(samples, 1, kept))
        two, found = clocked(lambda: studied(samples, WORKERS, kept))
        yield case, "by hand", here, "s", ""
        yield case, "one worker over by hand", one / here, "", "below 1.05"
        yield case, f"one worker over {WORKERS}", one / two, "", "above 1.9"
        if peers:
            ours, found = clocked(lambda: studied(few(samples, peers), WORKERS, kept))
            theirs, apart = by_exudyn(model, file, found)
            yield (
                f"{peers} of them, {WORKERS} processes",
                "Exudyn over rom",
                theirs / ours,
                "",
                ("above 20"),
            )
            yield f"{peers} of them", "difference of the slider's way", apart, "m", "below 1e-06"
    some = {"x": np.arange(float(shorts))}
    taken, _ = clocked(lambda: study(short, some, workers=WORKERS, progress=False), 1)
    overhead = taken - shorts * SHORT / WORKERS
    yield f"{shorts} samples of a millisecond", "beyond their own time", overhead, "s", "below 30"


def few(samples: dict[str, Any], n: int) -> dict[str, Any]:
    """So many of the samples, evenly."""
    rows = np.linspace(0, len(samples["speed"]) - 1, n).astype(int)
    return {name: x[rows] for name, x in samples.items()}


def studied(samples: dict[str, Any], workers: int, kept: Path) -> Study:
    """The study of slider-cranks, each kept in a file."""
    kept.unlink(missing_ok=True)
    return study(crank, samples, workers=workers, into=kept, progress=False)


def clocked(work: Callable[[], Any], times: int = TAKEN) -> tuple[float, Any]:
    """Shortest time by the clock [s], and what came of it."""
    taken = []
    for _ in range(times):
        start = perf_counter()
        found = work()
        taken.append(perf_counter() - start)
    return min(taken), found


def by_exudyn(model: Any, file: str, found: Study) -> tuple[float, float]:
    """Seconds of Exudyn's variation, and by how much a slider goes another way [m]."""
    body = load(file)
    runs = [
        Run(slider_crank(body, RADIUS, float(speed)), T_END, STEPS, 50).described
        for speed in found.parameters["speed"]
    ]
    with scratch("peers") as folder:
        places = [str(folder / "M.npz"), str(folder / "runs.json")]
        save_for_exudyn(model, places[0])
        Path(places[1]).write_text(json.dumps(runs))
        command = [interpreter(), str(SCRIPT_FILE), file, *places, str(WORKERS)]
        answer: Any = answer_of(command)
    apart = np.abs(np.array(answer["least"]) - found.values["least"]).max()
    return answer["seconds"], float(apart)
