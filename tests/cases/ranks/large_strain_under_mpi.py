"""Run by test_large_deflection.py under mpirun: energy and forces of shapes, summed over ranks."""

import sys

import numpy as np

import rom
from cases.boxes import box
from cases.solid import STEEL
from rom.body.nonlinear.statics import follow
from rom.fe.elasticity import assemble

mesh, faces = box((1.0, 0.1, 0.1), (8, 1, 1))
interfaces = {"root": faces["x0"], "tip": faces["x1"]}
model = assemble(mesh, facet_tags=interfaces, material=STEEL)
ops, energy = model.operators, model.stresses.large_strain()
x, y, z = model.points[ops.first // 3 : (ops.first + ops.n_local) // 3].T
fields = [(y * x, x * z, x**2), (np.sin(x), y**2, x * y), (z, x * y * z, np.cos(2 * x))]
E = np.column_stack([np.column_stack(field).ravel() for field in fields])
G = energy.gram(E)
F = ops.gram(E, energy.second_forces(E, np.array([[0, 1], [2, 2]])))
least, unresolved = energy.least_stretch(E), energy.unresolved(E)
solid, whole = model.stresses.finite_strain(), np.vstack(ops.comm.allgather(E))
far = whole @ [0.3, -0.2, 0.5]
resisted = np.column_stack([whole.T @ solid.force(far), whole.T @ (solid.tangent(far) @ whole)])
body = rom.reduce(
    model,
    method=rom.CraigBampton(n_modes=2),
    interfaces={"root": "rbe3", "tip": "rbe3"},
    reference="root",
    nonlinear=rom.Geometric(loads={"tip": (0, 1e6, 0, 0, 0, 0)}, n_modes=2, n_shapes=8),
    stress=True,
)
load = body.marker("tip").translation[1]
q = follow(body.quartic, 1e6 * np.outer([0.5, 1.0], load))[-1]
table = body.provenance["large deflection"].values()
errors = [[case[of] for of in ("displacement", "frequencies")] for case in table]
if ops.first == 0:
    tip = body.marker("tip").translation @ q
    order = np.lexsort(body.stress.points.T.round(9))
    arrays = {"G": G, "F": F, "resisted": resisted, "least": least, "errors": errors,
              "unresolved": unresolved}  # fmt: skip
    np.savez(sys.argv[1], tip=tip, stress=body.stress.field(q)[order], **arrays)
