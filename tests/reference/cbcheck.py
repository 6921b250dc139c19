"""Makes cbcheck.json: what pyyeti's cbcheck says of the matrices in cbcheck.npz.

Run with a Python that has pyyeti (1.4.7 when the numbers were made)::

    python tests/reference/cbcheck.py

The matrices are those of `tests/io/test_matrices.py`, which writes them when called as a script.
"""

import io
import json
from pathlib import Path

import numpy as np
import pyyeti
from pyyeti import cb
from pyyeti.nastran import n2p

HERE = Path(__file__).parent
given = np.load(HERE / "cbcheck.npz")
M, K, points = given["M"], given["K"], given["points"]
b = np.arange(6 * len(points))
uset = None
for k, point in enumerate(points):
    uset = n2p.addgrid(uset, k + 1, "b", 0, point, 0)
text = io.StringIO()
found = cb.cbcheck(text, M, K, b, b[:6], uset=uset, uref=(0.0, 0.0, 0.0), n_freefree_modes=16)
rigid = np.vstack([found.rbg, np.zeros((M.shape[0] - len(b), 6))])
numbers = {
    "program": f"pyyeti {pyyeti.__version__}, cb.cbcheck",
    "rigid body mass about the origin": (rigid.T @ M @ rigid).tolist(),
    "fixed-base frequencies [Hz]": found.cb_frq.tolist(),
    "effective mass": found.effmass.to_numpy().tolist(),
    "stiffness-based rigid motions": found.rbs[: len(b)].tolist(),
}
(HERE / "cbcheck.json").write_text(json.dumps(numbers, indent=1) + "\n")
