"""The body file does not depend on the number of processes that wrote it."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.long import ROM_LONG, SHARED_BY
from cases.paths import ROOT
from cases.ranks.environment import on_ranks

pytest.importorskip("dolfinx", reason="dolfinx is not installed")
pytestmark = [pytest.mark.fenicsx, pytest.mark.mpi]
ROD = ROOT / "meshes" / "connecting_rod.geo"
# modes of nearly one frequency are defined to round-off over the distance of their eigenvalues: in
# none of these rods two are closer than 1e-3, with fourier:1,1 and rbe2 two are 1.3e-4 apart
SIZE = "8e-3" if ROM_LONG else "14e-3"
KINDS = {"average and functions": ["pin_a=rbe3", "pin_b=polynomial:1"]}
if ROM_LONG:
    KINDS |= {
        "stiff and average": ["pin_a=rbe2", "pin_b=rbe3"],
        "functions": ["pin_a=polynomial:1", "pin_b=fourier:1,1"],
    }


@pytest.fixture(scope="module", params=KINDS)
def bodies(request, tmp_path_factory):
    """The same command on one process and on several."""
    folder, written = tmp_path_factory.mktemp("bodies"), {}
    for n in (1, *SHARED_BY):
        written[n] = folder / f"{n}.rom.npz"
        command = ["-m", "rom", "reduce"]
        command += [str(ROD), "-p", f"lc={SIZE}", "--E", "210e9", "--nu", "0.3", "--rho", "7850"]
        command += [word for kind in KINDS[request.param] for word in ("-i", kind)]
        command += ["-m", "20", "--reference", "pin_a", "-q", "-o", str(written[n])]
        done = on_ranks(n, *command)
        assert written[n].exists(), done.stderr
    return {n: rom.load(path) for n, path in written.items()}


def contents(body):
    """(name, array, size against which it counts); a frame makes parts of markers zero."""
    shape = np.abs(body.surface.shape).max()
    turn = max(np.abs(marker.rotation).max() for marker in body.markers.values())
    for name in ("mass", "first_moment", "inertia", "S", "Ibar_kl", "S_kl", "K", "omega"):
        array = np.asarray(getattr(body, name))
        yield name, array, np.abs(array).max()
    for marker in body.markers.values():
        yield f"{marker.name} point", marker.point, body.size
        yield f"{marker.name} translation", marker.translation, shape
        yield f"{marker.name} rotation", marker.rotation, turn
        yield f"{marker.name} hold", marker.hold, np.abs(marker.hold).max()
    yield "surface", body.surface.points, body.size
    yield "triangles", body.surface.triangles, 0.0
    yield "shapes", body.surface.shape, shape


@pytest.mark.parametrize("n", SHARED_BY)
def test_the_body_has_the_same_content_on_any_number_of_processes(bodies, n):
    for (name, one, size), (_, many, _) in zip(
        contents(bodies[1]), contents(bodies[n]), strict=True
    ):
        assert_allclose(many, one, rtol=0, atol=1e-9 * size, err_msg=name)
    assert bodies[n].labels == bodies[1].labels
    for one, many in zip(bodies[1].certificate.rows, bodies[n].certificate.rows, strict=True):
        assert (one.quantity, one.ok) == (many.quantity, many.ok)


def test_a_script_that_fails_on_one_rank_after_the_model_ends_on_all():
    """Nobody installed a hook: the model did."""
    script = (
        "from mpi4py import MPI; import rom; "
        f"model = rom.fe.model({str(ROD)!r}, material=rom.Material(E=2e11, nu=0.3, rho=7850.0), "
        "parameters={'lc': 0.012}); "
        "1 / (MPI.COMM_WORLD.rank - 1); MPI.COMM_WORLD.Barrier()"
    )
    done = on_ranks(3, "-c", script, timeout=60)
    assert done.returncode != 0
    assert done.stderr.count("ZeroDivisionError: division by zero") == 1
