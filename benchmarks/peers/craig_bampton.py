"""One Craig-Bampton reduction by another program; a script without rom.

``python craig_bampton.py matrices.npz PROGRAM KIND N_MODES`` prints {"seconds", "frequencies"}:
processor time from matrices to reduced matrices, reading excluded, and the natural frequencies of
the free reduced body [Hz], its rigid motions left out.

The file holds K and M as ``K_data``, ``K_indices``, ``K_indptr`` and alike, ``points`` (n/3, 3),
and the nodes of each interface as ``interface_0``, ``interface_1``, ...
"""

import json
import sys
from time import process_time
from typing import Any

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import coo_matrix, csc_matrix, csr_matrix, identity, vstack
from scipy.sparse.linalg import LinearOperator, eigsh, splu


def read(path: str) -> tuple[csr_matrix, csr_matrix, Any, list[Any]]:
    """K, M, points and the nodes of each interface."""
    data = np.load(path)
    points = data["points"]
    K, M = (
        csr_matrix(
            (data[f"{A}_data"], data[f"{A}_indices"], data[f"{A}_indptr"]), shape=(points.size,) * 2
        )
        for A in "KM"
    )
    names = sorted(name for name in data.files if name.startswith("interface_"))
    return K, M, points, [data[name] for name in names]


def stiff(points: Any, interfaces: list[Any]) -> tuple[csr_matrix, int]:
    """T of u = T a, a: other dofs, then six motions of each interface; and the number of others."""
    n = points.size
    gone = np.concatenate([(3 * nodes[:, None] + np.arange(3)).ravel() for nodes in interfaces])
    kept = np.setdiff1d(np.arange(n), gone)
    selection = coo_matrix((np.ones(kept.size), (kept, np.arange(kept.size))), shape=(n, kept.size))
    blocks = []
    for nodes in interfaces:
        x = points[nodes] - points[nodes].mean(axis=0)
        R = np.zeros((nodes.size, 3, 6))
        R[:, :, :3] = np.eye(3)
        R[:, 1, 3], R[:, 2, 3] = -x[:, 2], x[:, 1]
        R[:, 0, 4], R[:, 2, 4] = x[:, 2], -x[:, 0]
        R[:, 0, 5], R[:, 1, 5] = -x[:, 1], x[:, 0]
        dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
        rows, columns = np.repeat(dofs, 6), np.tile(np.arange(6), dofs.size)
        blocks.append(coo_matrix((R.ravel(), (rows, columns)), shape=(n, 6)))
    return csr_matrix(vstack([selection.T, *(block.T for block in blocks)]).T), kept.size


def by_scipy(K: Any, M: Any, points: Any, interfaces: list[Any], n_modes: int, solver: str) -> Any:
    """Stiff interfaces; one factor of K_ii by SuperLU or CHOLMOD for statics and for eigsh."""
    T, n = stiff(points, interfaces)
    K, M = (csc_matrix(T.T @ A @ T) for A in (K, M))
    K_ii, K_ib, M_ii = K[:n, :n], K[:n, n:].toarray(), M[:n, :n]
    if solver == "cholmod":
        from sksparse.cholmod import cholesky

        solve: Any = cholesky(K_ii)
    else:
        solve = splu(K_ii, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}).solve
    inverse = LinearOperator(K_ii.shape, matvec=solve)
    _, Phi = eigsh(K_ii, n_modes, M_ii, sigma=0.0, OPinv=inverse)
    n_b = K_ib.shape[1]
    Psi = np.zeros((n + n_b, n_b + n_modes))
    Psi[:n, :n_b], Psi[n:, :n_b], Psi[:n, n_b:] = -solve(K_ib), identity(n_b).toarray(), Phi
    return Psi.T @ (K @ Psi), Psi.T @ (M @ Psi)


def by_exudyn(K: Any, M: Any, points: Any, interfaces: list[Any], n_modes: int, kind: str) -> Any:
    """``FEMinterface.ComputeHurtyCraigBamptonModes``, rigid motions kept."""
    from exudyn.FEM import FEMinterface, HCBstaticModeSelection

    fem = FEMinterface()
    fem.nodes = {"Position": points}
    fem.massMatrix, fem.stiffnessMatrix = M, K
    mode = {
        "rbe2": HCBstaticModeSelection.RBE2,
        "rbe3": HCBstaticModeSelection.RBE3,
        "full": HCBstaticModeSelection.allBoundaryNodes,
    }[kind]
    fem.ComputeHurtyCraigBamptonModes(
        [nodes.tolist() for nodes in interfaces],
        nEigenModes=n_modes,
        useSparseSolver=True,
        computationMode=mode,
        excludeRigidBodyMotion=False,
    )
    Psi = fem.modeBasis["matrix"]
    return Psi.T @ (K @ Psi), Psi.T @ (M @ Psi)


def main(path: str, program: str, kind: str, n_modes: int) -> None:
    """Reduce and say how long it took."""
    given = read(path)
    start = process_time()
    if program == "exudyn":
        K_r, M_r = by_exudyn(*given, n_modes, kind)
    else:
        K_r, M_r = by_scipy(*given, n_modes, program)
    seconds = process_time() - start
    lam = eigh(0.5 * (K_r + K_r.T), 0.5 * (M_r + M_r.T), eigvals_only=True)
    frequencies = np.sqrt(np.maximum(lam[6:16], 0.0)) / (2 * np.pi)
    sys.stdout.write(json.dumps({"seconds": seconds, "frequencies": frequencies.tolist()}) + "\n")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], sys.argv[3], int(sys.argv[4]))
