"""`rom study`: keys of a file that vary, what is kept, and how a run that ended goes on."""

import json
import signal
import subprocess
import sys

import numpy as np
import pytest

import rom
from cases.command import environment, python, wait_until
from cases.command import rom as run
from cases.paths import ROOT
from cases.refusals import refuses
from cases.studied import PENDULUM
from rom.components.studies import design, pictures, read_study
from rom.components.studies.described import key_path
from rom.errors import ConfigError
from rom.process.mpirun import mpirun

STUDY = """
[study]
vary = { "bodies.bob.mass" = "0.5:2:log" }
keep = ["max(abs(pivot force))", "bob position z", "t"]
samples = 6
"""
BEAM = f"""
[geometry]
file = "{ROOT}/meshes/beam.geo"
parameters = {{ L = 0.2, b = 0.02, h = 0.01, hex = 1, nx = 8, ny = 1, nz = 1 }}
[material]
E = "210 GPa"
nu = 0.3
rho = 7850
[interfaces]
root = "rbe2"
tip = "rbe2"
[reduction]
modes = 4
[damping]
ratio = 0.01
"""
SWING = """
gravity = [0, 0, -9.81]
[bodies.rod]
file = "beam.toml"
[joints]
pivot = { kind = "revolute", between = [{ ground = [0, 0, 0] }, "rod.root"], axis = [0, 1, 0] }
[simulation]
t_end = "20 ms"
dt = "1 ms"
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "pendulum.toml"
    path.write_text(PENDULUM + STUDY)
    return path


def test_force_of_a_pendulum_is_three_weights_at_every_mass(file, tmp_path):
    done = run("study", file, "-j", 2, "-q", "--json", "-o", tmp_path / "p.study")
    assert done.returncode == 0, done.stderr
    said, found = json.loads(done.stdout), read_study(tmp_path / "p.study")
    m, force = found.parameters["bodies.bob.mass"], found.values["max(abs(pivot force))"]
    assert force == pytest.approx(3 * m * 9.81, rel=2e-4)  # it passes the lowest point
    assert said["samples"] == 6 and not said["failures"]
    expected = np.quantile(force, (0.05, 0.5, 0.95))
    assert said["values"]["max(abs(pivot force))"] == pytest.approx(expected)
    # options go before the table of the file
    more = ("--vary", 'joints."pivot".at=0:1', "--keep", "t", "-n", 2)
    done = run("study", file, *more, "-o", tmp_path / "q")
    assert done.returncode == 2 and "joints.pivot" in done.stderr


def test_functions_take_columns_and_vectors(file):
    kept = ["abs(pivot force)", "range(bob position z)", "last(bob position x)", "mean(t)", "t"]
    kept += ["min(bob position z)", "rms(t)", "bob position"]
    found = rom.study(file, {"bodies.bob.mass": [1.0]}, keep=kept, workers=0)
    motion = rom.read_mechanism(file).simulate()
    force, (x, _, z) = np.linalg.norm(motion.reaction("pivot"), axis=1), motion.position("bob").T
    expected = [force, np.ptp(z), x[-1], motion.t.mean(), motion.t, z.min(),
                np.sqrt((motion.t**2).mean()), motion.position("bob")]  # fmt: skip
    for name, value in zip(kept, expected, strict=True):
        assert found.values[name][0] == pytest.approx(value, abs=1e-12), name


def test_a_key_has_its_tables_in_front():
    assert key_path('joints."main bearing".axis') == ("joints", "main bearing", "axis")


def test_what_cannot_be_is_said_before_anything_moves(file):
    mass = {"bodies.bob.mass": [1.0, 2.0]}
    rows = (
        ("max(nonsense)", mass, "'nonsense'"), ("max(bob position)", mass, "no single column"),
        ("sum(t)", mass, "no function 'sum'"), ((), mass, "say what to keep"),
        ("t", {"bodies.bob.mas": [1.0]}, "'mas'.*Did you mean mass"),
        ("t", {"bodies.bob.mass": [-1.0]}, "bodies.bob.mass = -1"),
        ("t", {"mesh.lc": [1.0]}, "no key 'mesh'"),
    )  # fmt: skip
    for keep, samples, words in rows:
        for workers in (0, 1):
            refuses(ConfigError, words, rom.study, file, samples, keep=keep, workers=workers)


def test_ranges_are_refused_by_name(file):
    for words, named in (("1:2:lin", "1:2:lin"), ("2:1", "bodies.bob.mass"), ("a:b", "'a:b'")):
        done = run("study", file, "--vary", f"bodies.bob.mass={words}")
        assert done.returncode == 2 and named in done.stderr
    gone = ("--vary", "simulation.rho_inf=1.5:2", "-n", 2, "-o", file.with_suffix(".gone"))
    done = run("study", file, *gone)  # no sample can be moved
    assert done.returncode in (2, 5) and "rho_inf" in done.stderr
    file.write_text(PENDULUM + STUDY.replace("0.5:2:log", "0.5-2"))
    done = run("study", file)
    assert done.returncode == 2 and "study.vary.bodies.bob.mass" in done.stderr


def test_a_run_that_was_interrupted_goes_on_to_the_same_table(file, tmp_path):
    whole, cut = tmp_path / "whole.study", tmp_path / "cut.study"
    line = ("study", str(file), "-n", "60", "-j", "1", "--seed", "7", "-q")
    assert run(*line, "-o", whole).returncode == 0
    command = [sys.executable, "-m", "rom", *line, "-o", str(cut)]
    begun = subprocess.Popen(command, env=environment(), stderr=subprocess.PIPE)
    wait_until(lambda: cut.exists() and cut.read_bytes().count(b"\n") > 3, 60)
    begun.send_signal(signal.SIGINT)
    assert begun.wait(20) == 7 and b"--resume" in begun.stderr.read()
    there = cut.read_bytes()
    assert run(*line, "-o", cut).returncode == 2
    assert run(*line, "-o", cut, "--resume").returncode == 0
    assert cut.read_bytes().startswith(there)
    for name, x in read_study(whole).values.items():
        assert x.tobytes() == read_study(cut).values[name].tobytes()


def test_pictures_say_what_was_measured(file, tmp_path):
    pytest.importorskip("matplotlib", reason="pictures need matplotlib")
    samples = {"bodies.bob.mass": [1.0, 1.5, 2.0]}
    found = rom.study(file, samples, keep=["max(abs(pivot force))", "bob position z", "t"],
                      workers=0)  # fmt: skip
    (axes,) = pictures.scatter_matrix(found, tmp_path / "a.png").axes
    assert axes.get_xlabel() == "bodies.bob.mass" and (tmp_path / "a.png").exists()
    (axes,) = pictures.bands(found, "bob position z", unit="[m]").axes
    assert axes.get_ylabel() == "bob position z [mm]" and len(axes.lines) == 3
    refuses(ConfigError, "'t' is no history|no history", pictures.bands, found,
            "max(abs(pivot force))")  # fmt: skip


@pytest.fixture
def swing(tmp_path):
    (tmp_path / "beam.toml").write_text(BEAM)
    path = tmp_path / "swing.toml"
    path.write_text(SWING)
    return path


@pytest.mark.fenicsx
@pytest.mark.slow
def test_geometries_vary_and_bodies_of_equal_parameters_are_made_once(swing, tmp_path, monkeypatch):
    samples = {"bodies.rod.mesh.b": [0.02, 0.02, 0.04], "mesh.h": 3 * [0.012],
               "bodies.rod.damping.ratio": [0.01, 0.05, 0.01]}  # fmt: skip
    keep = ["max(abs(pivot force))", "rod tip position"]
    found = rom.study(swing, samples, keep=keep, workers=2)
    assert not found.failed
    for k in (0, 1, 2):
        values = [x[k] for x in samples.values()]
        parts = (
            ("geometry", "parameters", "b"),
            ("geometry", "parameters", "h"),
            ("damping", "ratio"),
        )
        body = rom.read_component(
            tmp_path / "beam.toml", dict(zip(parts, values, strict=True))
        ).body()
        rom.save(body, tmp_path / f"{k}.rom.npz")
        place = {("bodies", "rod", "file"): str(tmp_path / f"{k}.rom.npz")}
        motion = rom.read_mechanism(swing, place).simulate()
        assert found.values[keep[1]][k] == pytest.approx(motion.position("rod", "tip"), abs=1e-12)
    force = found.values[keep[0]]
    assert force[2] == pytest.approx(2 * force[0], rel=1e-3)  # twice as wide, twice as heavy
    made = []
    monkeypatch.setattr(
        rom.components.studies.described,
        "_make",
        lambda place, changes, path, trust: made.append(path.write_bytes(b"")),
    )
    again = samples | {"mesh.h": [0.012, 0.012, 0.011], "bodies.rod.mesh.b": 3 * [0.02],
                       "bodies.rod.damping.ratio": 3 * [0.01]}  # fmt: skip
    rom.study(swing, again, keep=keep, workers=0)
    assert len(made) == 2
    monkeypatch.undo()
    swing.write_text(SWING.replace('"beam.toml"', '"other.toml"'))  # read anew by each study
    (tmp_path / "other.toml").write_text(BEAM.replace("modes = 4", "modes = 3"))
    one = {name: x[:1] for name, x in samples.items()}
    assert rom.study(swing, one, keep="rod elastic", workers=0).values["rod elastic"].shape[2] == 9
    bad = rom.study(swing, samples | {"mesh.h": [0.01, -1.0, 0.01]}, keep=keep, workers=2)
    assert list(bad.failed) == [1] and "beam.geo" in bad.failed[1]


@pytest.mark.long
@pytest.mark.fenicsx
@pytest.mark.mpi
def test_ranks_of_mpi_mesh_alone(swing, tmp_path):
    out, script = tmp_path / "x.study", tmp_path / "by_mpi.py"
    samples = {"mesh.h": [0.01, 0.011, -1.0]}
    script.write_text(
        "from mpi4py.futures import MPIPoolExecutor\nimport rom\n"
        "if __name__ == '__main__':\n    with MPIPoolExecutor() as executor:\n"
        f"        rom.study({str(swing)!r}, {samples!r}, executor=executor, "
        f"keep='rod tip position', into={str(out)!r})\n"
    )
    done = python("-m", "mpi4py.futures", script, launcher=mpirun(3))
    assert done.returncode == 0, done.stderr
    here = rom.study(swing, samples, keep="rod tip position", workers=1)
    found = read_study(out)
    assert found.failed == here.failed and list(here.failed) == [2]
    bits = [x.values["rod tip position"].tobytes() for x in (found, here)]
    assert bits[0] == bits[1]


@pytest.mark.long
@pytest.mark.fenicsx
@pytest.mark.mpi
@pytest.mark.timeout(3600)
def test_two_hundred_rods_are_the_same_by_all_engines_and_after_ten_kills(swing, tmp_path):
    """Each with a length, a width and a height of its own: meshed, reduced, certified, moved."""
    distributed = pytest.importorskip("distributed", reason="dask's cluster is not installed")
    generator, n = np.random.default_rng(5), 200
    ranges = {"mesh.L": (0.1, 0.3), "mesh.b": (0.01, 0.03), "mesh.h": (0.008, 0.02)}
    samples, keep = design(ranges, n, rng=generator), "max(abs(pivot force))"
    (tmp_path / "samples.json").write_text(json.dumps({k: x.tolist() for k, x in samples.items()}))
    script = tmp_path / "rods.py"
    script.write_text(
        "import json, sys\nfrom pathlib import Path\nimport rom\n"
        f"samples = json.loads(Path({str(tmp_path / 'samples.json')!r}).read_text())\n"
        f"def study(**how):\n    rom.study({str(swing)!r}, samples, keep={keep!r}, "
        "into=sys.argv[1], resume=True, **how)\n"
        "if __name__ == '__main__' and len(sys.argv) < 3:\n    study(workers=2)\n"
        "elif __name__ == '__main__':\n"
        "    from mpi4py.futures import MPIPoolExecutor\n"
        "    with MPIPoolExecutor() as executor:\n        study(executor=executor)\n"
    )
    whole, cut, ranks = (tmp_path / f"{name}.study" for name in ("whole", "cut", "ranks"))
    assert python(script, whole, timeout=1800).returncode == 0
    rows = 1
    for at in np.sort(generator.choice(np.arange(5, n - 5), 10, replace=False)):
        begun = subprocess.Popen([sys.executable, script, cut], env=environment())
        wait_until(lambda at=at: cut.exists() and cut.read_bytes().count(b"\n") > at, 900)
        begun.kill()
        begun.wait()
        assert cut.read_bytes().count(b"\n") >= rows
        rows = cut.read_bytes().count(b"\n")
    assert python(script, cut, timeout=1800).returncode == 0
    done = python("-m", "mpi4py.futures", script, ranks, "mpi", launcher=mpirun(3), timeout=3000)
    assert done.returncode == 0, done.stderr
    how = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(**how) as cluster, distributed.Client(cluster) as client:
        dask = rom.study(swing, samples, keep=keep, executor=client.get_executor())
    found = [read_study(path) for path in (whole, cut, ranks)] + [dask]
    force = found[0].values[keep]
    assert force.shape == (n,) and np.isfinite(force).all()
    for other in found:
        assert other.values[keep].tobytes() == force.tobytes() and not other.failed
    numbers = [row["sample"] for row in _rows(cut)]
    assert sorted(numbers) == list(range(n))


def _rows(path):
    return [json.loads(line[9:]) for line in path.read_bytes().splitlines()[1:]]
