"""Where the time of a reduction goes, as the body keeps it."""

import time

import numpy as np
import pytest

import rom
from cases.solid import STEEL, block, reduced
from rom.process.stopwatch import FACTORISATION_PIECE as FACTORS
from rom.process.stopwatch import FLOPS_NOTE, MISS_NOTE, REST_PIECE, piece, stopwatch
from rom.report.pages import _stages

STAGES = ["interfaces", "shapes", "energies", "body", "comparison"]


def test_pieces_within_pieces_count_once():
    """Sleeps of known length: stages add up to the whole, each piece without those inside it."""
    with stopwatch() as watch:
        watch.begin("one")
        time.sleep(0.02)
        with piece("outer"):
            time.sleep(0.03)
            with piece("inner"):
                time.sleep(0.05)
        watch.begin("two")
        with piece("inner"):
            time.sleep(0.04)
        watch.begin("one")
        with piece("inner"):
            time.sleep(0.01)
    one, two = watch.table()["one"], watch.table()["two"]
    assert one["rest"] >= 0.02 and one["outer"] >= 0.03 and one["inner"] >= 0.06
    assert one["outer"] < one["inner"]
    assert two["inner"] >= 0.04 and "outer" not in two
    assert one["number of inner"] == 2 and one["number of outer"] == two["number of inner"] == 1
    for stage in (one, two):
        total = sum(stage.get(name, 0.0) for name in (REST_PIECE, "outer", "inner"))
        assert stage["seconds"] == pytest.approx(total, abs=1e-3)
    assert two["MB"] >= one["MB"] > 1.0 or one["MB"] >= two["MB"] > 1.0


def test_time_after_an_error_belongs_to_what_was_under_way():
    with stopwatch() as watch, piece("outside of any stage"):
        watch.begin("one")
        with pytest.raises(ZeroDivisionError), piece("fails"):
            1 / 0  # noqa: B018
        time.sleep(0.02)
    assert watch.table()["one"]["fails"] < 0.01
    with piece("nobody looks"):
        pass
    assert set(watch.table()) == {"one"}


def test_a_body_its_file_and_its_report_say_where_its_time_went(tmp_path):
    """Stages in their order; together they are the time it took."""
    assert list(reduced(4, block()).provenance["stages"]) == STAGES[:-1]
    start = time.perf_counter()
    stages = (body := reduced(4, block(), certify=True)).provenance["stages"]
    taken = time.perf_counter() - start
    assert list(stages) == STAGES
    total = sum(stage["seconds"] for stage in stages.values())
    assert 0.5 * taken < total < taken + 0.01
    before = sum(stages[name]["seconds"] for name in STAGES[:-1])
    assert body.provenance["seconds to reduce"] == pytest.approx(before, abs=0.01)
    assert stages["shapes"]["number of factorisations"] >= 1
    assert stages["shapes"][FACTORS] < stages["shapes"]["seconds"]
    assert all(np.isfinite(list(stage.values())).all() for stage in stages.values())
    again = rom.load(rom.save(body, tmp_path / "body.rom.npz"))
    assert again.provenance["stages"] == stages
    page, number = "".join(_stages(stages)), stages["comparison"]["number of factorisations"]
    for words in ("comparison", "factorisations", f"({number})", "memory [MB]"):
        assert words in page
    assert _stages({}) == []


@pytest.mark.fenicsx
def test_pieces_of_a_model_in_petsc_are_counted():
    """Constraint shapes and modes take one factor of the inside, which no count follows."""
    import rom.fe

    body = reduced(6, rom.fe.model("meshes/beam.geo", material=STEEL))
    shapes = body.provenance["stages"]["shapes"]
    assert shapes["number of factorisations"] == shapes["ranks"] == 1
    assert 1e6 < shapes[FLOPS_NOTE] < 1e12 and 0.0 <= shapes[MISS_NOTE] < 1e-9
    page = "".join(_stages(body.provenance["stages"]))
    assert f"{shapes[FLOPS_NOTE]:.1e}" in page and f"{shapes[MISS_NOTE]:.1e}" in page
    assert shapes["number of searches"] == 1 and shapes["number of solutions"] > 1
    pieces = [shapes[name] for name in (FACTORS, "solutions", "searches", REST_PIECE)]
    assert sum(pieces) == pytest.approx(shapes["seconds"], abs=1e-3)
