"""The valid files that cases damage, and small models in memory."""

from pathlib import Path
from typing import Any

from scipy.io import mmwrite

import rom
from cases.boxes import BOX_GEO
from cases.files import damage
from cases.files.cells import blocks_of, solid, write_msh
from cases.files.toml_files import PENDULUM
from cases.solid import KINDS, block

PLANTED = "pwned"  # part of the name of every file that planted code makes
MATRICES = "K.mtx --mass M.mtx --nodes deck.inp -i root=rbe2 -i tip=rbe2 --no-certificate -m 4"
PART = """name = "part"
[matrices]
stiffness = "K.mtx"
mass = "M.mtx"
nodes = "deck.inp"
[interfaces]
root = "rbe2"
tip = "rbe2"
[reduction]
modes = 4
reference = "root"
certificate = false
"""
LOCK = """gravity = [0, 0, 0]
[bodies]
a = { mass = 1.0, inertia = [1e-3, 1e-3, 1e-3], at = [0.1, 0, 0], markers.c = [0, 0, 0] }
b = { mass = 1.0, inertia = [1e-3, 1e-3, 1e-3], at = [0, 0.2, 0], markers.c = [0, 0, 0] }
[joints]
x = { kind = "prismatic", between = [{ ground = [0, 0, 0] }, "a.c"], axis = [1, 0, 0] }
y = { kind = "prismatic", between = [{ ground = [0, 0, 0] }, "b.c"], axis = [0, 1, 0] }
rod = { kind = "distance", between = ["a.c", "b.c"] }
[drives]
push = { joint = "x", law = { kind = "run-up", rate = 1.0, duration = 0.05 } }
[simulation]
t_end = 1.0
dt = 0.005
"""


def fill(folder: Path) -> None:
    folder.mkdir()
    geo = 'DefineConstant[ lc = {1, Name "lc"} ];\n' + BOX_GEO.replace("= 1;", "= lc;")
    texts = {"box.geo": geo, "part.toml": PART, "pendulum.toml": PENDULUM, "lock.toml": LOCK}
    for name, content in texts.items():
        (folder / name).write_text(content)
    box = solid()
    write_msh(folder / "box.msh", box.points, *blocks_of(box))
    rom.save(body(), folder / "good.npz")
    rom.export(body(), folder / "good.SID_FEM")
    matrices(folder)
    damage.state(folder).rename(folder / "good.state.npz")
    damage.family(folder).rename(folder / "family.npz")


def model(cells: Any = (2, 1, 1)) -> Any:
    """A block of bricks with the interfaces root and tip, without FEniCSx."""
    return block(cells=cells)


def body(**options: Any) -> Any:
    keywords = {"method": rom.CraigBampton(4), "interfaces": KINDS, "certify": False} | options
    return rom.reduce(model((4, 1, 1)), **keywords)


def pendulum(**bob: Any) -> Any:
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    numbers = {"mass": 1.0, "inertia": (1e-3,) * 3, "at": (0.2, 0, 0)}
    part = mech.add_rigid("bob", **(numbers | {"markers": {"pin": (-0.2, 0, 0)}} | bob))
    mech.revolute("hinge", mech.ground.marker((0, 0, 0)), part.marker("pin"), axis=(0, 0, 1))
    return mech


def compile_kernels() -> None:
    """Compile what cases call, where nothing is compiled yet: that is no hang."""
    for method in ("generalized-alpha", "dop853"):
        rom.simulate(pendulum(), t_end=0.02, dt=0.01, method=method)


def matrices(folder: Path) -> None:
    made = model()
    mmwrite(str(folder / "K.mtx"), made.K, symmetry="symmetric")
    mmwrite(str(folder / "M.mtx"), made.M, symmetry="symmetric")
    rows = [f"{n}, " + ", ".join(map(repr, map(float, x))) for n, x in enumerate(made.points, 1)]
    sets = [
        f"*NSET, NSET={name}\n" + ", ".join(map(str, interface.nodes + 1))
        for name, interface in made.interfaces.items()
    ]
    (folder / "deck.inp").write_text("\n".join(["*NODE", *rows, *sets]) + "\n")
