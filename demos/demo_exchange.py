# # One body, many programs
#
# A reduced body is worth as much as the places it can go. One beam is written for Simpack, Nastran,
# Abaqus, OpenFAST, MBDyn, Exudyn and Simscape; what comes back from the files has the same mass and
# frequencies. Then it swings, and the motion leaves as a table and as a film to turn around.
#
# Run: `python demos/demo_exchange.py`, or under `mpirun -n 2`
# Time: 15 s
# Writes: eleven files named `beam` and a picture into `out/`; another folder with `--out`

import argparse
from pathlib import Path

from mpi4py import MPI

import numpy as np
from scipy.linalg import eigh

import rom
from rom import view
from rom.io import check_sid, read_dmig, read_openfast, sid_body, standard_input, write_sid

options = argparse.ArgumentParser(description="one body for many programs")
options.add_argument("--out", type=Path, default=Path("out"), help="folder, made if missing")
options.add_argument("-q", "--quiet", action="store_true", help="no tables")
options = options.parse_args()
first = MPI.COMM_WORLD.rank == 0
say = print if first and not options.quiet else lambda *_: None

# ## The body
#
# A steel beam of 1 m with a section of 50 mm x 30 mm; its mean-axis frame suits all programs.

L, b, h, E, rho = 1.0, 0.05, 0.03, 210e9, 7850.0
model = rom.fe.model(
    Path(__file__).parents[1] / "meshes" / "beam.geo",
    material=rom.Material(E=E, nu=0.3, rho=rho),
    parameters={"L": L, "b": b, "h": h, "lc": 0.03},
)
body = rom.reduce(
    model, method=rom.CraigBampton(n_modes=8), interfaces={"root": "rbe2", "tip": "rbe2"},
    name="beam", reference="mean-axis", certify=False,
)  # fmt: skip
results = {"mass [kg]": (body.mass, rho * L * b * h, 1e-9)}

if first:
    out = options.out
    out.mkdir(parents=True, exist_ok=True)

    # ## Out
    #
    # The ending chooses the format; `rom export beam.rom.npz beam.fem` does the same.

    for ending, program in {
        "vtu": "ParaView", "dmig": "Nastran", "op4": "Nastran, all digits", "fem": "MBDyn",
        "inp": "Abaqus", "py": "Exudyn", "mat": "Simscape Multibody",
    }.items():  # fmt: skip
        path = rom.export(body, out / f"beam.{ending}")
        say(f"{path.name:16s} {path.stat().st_size / 1e3:8.1f} kB  {program}")

    # ## And back: Nastran's matrices
    #
    # Six rows for each interface, then modes. Without the rows of the root it is a cantilever.

    K, M = (read_dmig(out / "beam.dmig")[name][0].toarray() for name in ("KAAX", "MAAX"))
    K, M = (A + np.tril(A, -1).T for A in (K, M))
    cantilever = np.sqrt(eigh(K[6:, 6:], M[6:, 6:], eigvals_only=True)[:4]) / (2 * np.pi)
    say("cantilever from DMIG:", *(f"{f:8.2f}" for f in cantilever), "Hz")

    # ## And back: a superelement of OpenFAST
    #
    # The root is held, the six coordinates of the tip come first. Their stiffness alone is that of
    # a cantilever under a load at its end; the weight stands beside.

    rom.export(body, out / "beam.dat", to="openfast", held=["root"])
    element = read_openfast(out / "beam.dat")
    tower = np.sqrt(eigh(element.K, element.M, eigvals_only=True)[:4]) / (2 * np.pi)
    sag = np.linalg.solve(element.K[:6, :6], element.weight[:6])[2]
    say("cantilever from OpenFAST:", *(f"{f:8.2f}" for f in tower), f"Hz, sag {1e3 * sag:.4f} mm")

    # ## Standard Input Data, in three dialects
    #
    # Programs agree on the shapes of the blocks, not on the order of columns. A wrong order gives
    # wrong motion and no error, so that reading decides by what the blocks must have in common.

    record = standard_input(body)
    for dialect in ("pysid", "geisler", "fembs"):
        write_sid(record, out / "beam.SID_FEM", dialect=dialect)
        back = rom.read_sid(out / "beam.SID_FEM")
        worst = max(row.value for row in check_sid(back).rows[:-1])
        say(f"written as {dialect:8s} read as {back.dialect:8s} worst relation {worst:.1e}")
    returned = sid_body(back).frequencies(4, fixed=("root",))

    # ## A motion, for the table and for the slides
    #
    # The beam falls about its root for half a second.

    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    beam = mech.add_flexible("beam", body)
    hinge = mech.ground.marker(tuple(body.markers["root"].point))
    mech.revolute("hinge", hinge, beam.marker("root"), axis=(0, 1, 0))
    sol = rom.simulate(mech, t_end=0.5, dt=1e-3)
    history = rom.write_history(sol, out / "beam.csv")
    film = rom.write_animation(sol, out / "beam.glb", magnify=500)
    head, *lines = history.read_text().splitlines()
    tip = [float(line.split(",")[head.split(",").index("beam markers tip position z [m]")])
           for line in lines]  # fmt: skip
    say(f"{history.name}: {len(head.split(','))} columns; {film.name}: {film.stat().st_size} bytes")

    turning = np.linalg.norm(sol.velocity("beam", "tip"), axis=1) / L
    view.history(
        sol.t,
        [
            ("height of the tip,\nfrom beam.csv [m]", {"": tip}),
            ("speed of turning [rad/s]", {"": turning}),
        ],
        out / "exchange.png",
        title="The beam that is exchanged, falling about its root",
        beside=[
            view.posed(mech, sol, time, title=f"After {time:g} s", magnify=500, up=(0, 0, 1),
                       view=(0.2, -1.0, 0.25)) for time in (0.1, 0.3)
        ],
        caption="Above: height of the tip, read back from the table beam.csv. Below: how fast it "
        "turns, and swings meanwhile. Right: the beam, its deformation drawn 500 times larger as "
        "in the film beam.glb; colours are displacements against its mean axes.",
    )  # fmt: skip

    # ## What to remember
    #
    # `tests/project/test_demos.py` checks the numbers below: value, expected value, relative
    # tolerance. The fall is that of a rigid rod, I theta'' = m g L/2 cos(theta), whose energy gives
    # theta' at any angle; the bending of a falling beam is small.

    EI = np.sqrt(E * h**2 / (12 * rho)) / (2 * np.pi * L**2)
    inertia = rho * b * h * L**3 / 3 + rho * b * h * L * h**2 / 12
    drop = tip[0] - tip[-1]
    speed = np.sqrt(rho * b * h * L * 9.81 * drop / inertia)
    held = body.frequencies(4, fixed=("root",))
    sagging = -rho * b * h * 9.81 * L**4 / (8 * E * b * h**3 / 12)
    results |= {
        "cantilever from DMIG, Euler and Bernoulli [Hz]": (cantilever[0], 1.875104**2 * EI, 0.01),
        "worst frequency ratio, DMIG": (1 + np.abs(cantilever / held - 1).max(), 1.0, 1e-7),
        "worst frequency ratio, OpenFAST": (1 + np.abs(tower / held - 1).max(), 1.0, 1e-7),
        "sag of the tip under its weight, Euler and Bernoulli [m]": (sag, sagging, 0.01),
        "worst frequency ratio, SID": (1 + np.abs(returned / held - 1).max(), 1.0, 1e-8),
        "worst relation of the SID blocks": (1 + worst, 1.0, 1e-9),
        "turning after the fall [rad/s]": (turning[-1], speed, 0.01),
    }
    for name, (value, expected, tolerance) in results.items():
        print(f"{name}: {value:.9g}, expected {expected:.9g} within {tolerance:g}")
