"""The first hour of four newcomers, on a machine with nothing but Python: seconds and what is left.

    sudo .ci/other_systems.sh walks trixie

An engineer with parts of CAD programs, a student, an analyst with a deck and a control engineer
type what the pages say, and what a command has said to type next. A command that fails where the
pages do not say so, or leaves nothing, ends the walk.
"""

import re
import shlex
import shutil
import subprocess
import sys
import time
from pathlib import Path

HOME = Path(__file__).resolve().parent.parent
BIN = HOME / ".venv" / "bin"
PARTS = """
import re
import gmsh
gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
cad = gmsh.model.occ
def part(name, inch, *boxes, bores=()):
    gmsh.clear()
    solids = [(3, cad.addBox(*box)) for box in boxes]
    if bores:
        cad.cut(solids, [(3, cad.addCylinder(*at, -50, 0, 0, 100, r)) for at, r in bores])
    cad.synchronize()
    gmsh.write(name)
    if inch:
        text = open(name).read()
        number = re.search(r"#(\\d+) = \\( *LENGTH_UNIT", text)[1]
        new = (
            "( CONVERSION_BASED_UNIT('INCH',#9001) LENGTH_UNIT() NAMED_UNIT(#9003) );\\n"
            "#9001 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#9002);\\n"
            "#9002 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );\\n"
            "#9003 = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);"
        )
        text = re.sub(rf"#{number} = \\([^;]*;", lambda m: f"#{number} = {new}", text)
        open(name, "w").write(text)
part("bracket.step", False, (0, 0, 0, 90, 30, 10), bores=[((15, 15), 7), ((75, 15), 4)])
part("sheet.step", False, (0, 0, 0, 120, 80, 1), bores=[((20, 40), 6)])
part("two.step", False, (0, 0, 0, 80, 20, 10), (80, 0, 0, 20, 20, 40), bores=[((10, 10), 5)])
part("inches.step", True, (0, 0, 0, 4, 1, 0.5), bores=[((0.5, 0.5), 0.25)])
"""
POLES = """
import rom, scipy.signal
mech = rom.Mechanism(gravity=(0, 0, 0))
body = rom.load("../student/first.rom.npz")
arm = mech.add_flexible("arm", body)
mech.fixed("clamp", mech.ground.marker(tuple(body.marker("root").point)), "arm.root")
system = scipy.signal.StateSpace(
    *rom.linearize(mech).to_statespace(["arm.tip z"], ["arm.tip z rate"]))
lowest = min(abs(system.poles)) / 6.283185307179586
assert abs(lowest / body.frequencies(1, fixed=("root",))[0] - 1) < 1e-6
"""
UNIT = """
import fmpy, rom, zipfile
with zipfile.ZipFile("unit.fmu", "w") as file:
    file.write("controller3.xml", "modelDescription.xml")
    file.write("c.so", f"binaries/{fmpy.platform_tuple}/c.so")
def moved(law=None, **unit):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    mech.add_rigid("hub", mass=1, inertia=(0.1, 0.1, 0.1), at=(0, 0, 0))
    mech.revolute("hinge", "ground", "hub", axis=(0, 0, 1))
    mech.motor("servo", "hinge", law or (lambda t, x, v: 0.0), every=law and 2e-3)
    if unit:
        mech.fmu("unit.fmu", **unit)
    return rom.simulate(mech, t_end=0.2, dt=1e-3).joint("hinge").angle
inputs = {"angle": "hinge angle", "rate": "hinge.angle rate", "target": 0.2, "gain": 30,
          "damping": 3}
unit = moved(inputs=inputs, outputs={"torque": "servo"}, every=2e-3)
law = moved(lambda t, x, v: -30 * (x - 0.2) - 3 * v)
assert abs(unit - law).max() < 1e-12 and abs(law[-1]) > 0.05
"""


class Walk:
    """Commands of one newcomer, in a folder of its own."""

    def __init__(self, name):
        self.name, self.start, self.commands = name, time.perf_counter(), 0
        self.folder = HOME / "build" / "walks" / name
        self.folder.mkdir(parents=True)

    def types(self, line, *, fails=""):
        """What a command has said; where it is to fail, the words that it fails with."""
        self.commands += 1
        begun = time.perf_counter()
        words = [
            str(BIN / word) if word in ("rom", "python", "pip") else word
            for word in shlex.split(line)
        ]
        done = subprocess.run(words, cwd=self.folder, capture_output=True, text=True)
        said = done.stdout + done.stderr
        if (
            bool(done.returncode) != bool(fails)
            or fails not in said
            or ("Traceback" in said and not fails)
        ):
            sys.exit(f"{self.name}: {line}\n{said}\nended with {done.returncode}")
        print(f"{time.perf_counter() - begun:6.1f} s  {line}", flush=True)
        return said

    def runs(self, page, *which):
        """These blocks of Python of a page, as one program."""
        text = (HOME / "docs" / page).read_text()
        blocks = re.findall(r"^```python\n(.*?)^```$", text, re.M | re.S)
        (self.folder / "block.py").write_text("".join(blocks[k] for k in which))
        return self.types("python block.py")

    def leaves(self, *names):
        """These files are there."""
        for name in names:
            if not [path for path in self.folder.glob(name) if path.stat().st_size]:
                sys.exit(f"{self.name}: {name} is missing")

    def ends(self):
        """What it took."""
        files = sum(path.is_file() for path in self.folder.rglob("*"))
        took = f"{time.perf_counter() - self.start:.0f} s, {self.commands} commands"
        print(f"{self.name}: {took}, {files} files", flush=True)


def next_command(said):
    """What a list of faces says to type."""
    return re.findall(r"^ +(rom swing .*)$", said, re.M)[-1]


def engineer(installed):
    """A bracket, a sheet, two solids that touch and a drawing in inches, all to a report."""
    walk = Walk("engineer")
    (walk.folder / "parts.py").write_text(PARTS)
    walk.types("python parts.py")
    start = time.perf_counter()
    walk.types(next_command(walk.types("rom swing bracket.step")))
    first = installed + time.perf_counter() - start
    walk.leaves(
        "bracket_swing/*.rom.npz",
        "bracket_swing/*.png",
        "bracket_swing/*.html",
        "bracket_swing/run.json",
        "bracket_swing/scene.json",
    )
    print(f"first picture that moves: {first:.0f} s after pip began", flush=True)
    command = next_command(walk.types("rom swing sheet.step"))
    size = re.search(r"elements of ([\d.e-]+) m", walk.types(command))[1]
    if "elements of" in walk.types(f"{command} -p lc={size} --force"):
        sys.exit("engineer: the size that is advised is not small enough")
    walk.types("rom swing two.step", fails="--unite")
    walk.types(next_command(walk.types("rom swing two.step --unite")))
    said = walk.types("rom swing inches.step")
    if "0.1016 x 0.0254 x 0.0127 m" not in said:
        sys.exit(f"engineer: four inches by one by a half are not 101.6 mm by 25.4 by 12.7: {said}")
    walk.types(next_command(said))
    walk.leaves("sheet_swing/*.html", "two_swing/*.html", "inches_swing/*.html")
    walk.ends()


def student(_):
    """The first page in Python, and a name that is guessed wrong."""
    walk = Walk("student")
    walk.runs("start.md", 0, 1)
    walk.leaves("first.rom.npz", "first.png")
    wrong = "import rom; print(getattr(rom.Mechanism(), 'add_rigid_body'))"
    walk.types(f'python -c "{wrong}"', fails="'add_rigid'")
    walk.ends()


def analyst(_):
    """A deck, as the page on decks says."""
    walk = Walk("analyst")
    page = (HOME / "docs" / "deck.md").read_text()
    for line in re.search(r"^```sh\n(.*?)^```$", page, re.M | re.S)[1].splitlines():
        walk.types(line.split("#")[0])
    walk.leaves("beam.inp", "beam.rom.npz")
    walk.ends()


def control(_):
    """Poles and gains for a design, the controller sampled, and as a unit of another program."""
    walk = Walk("control")
    (walk.folder / "poles.py").write_text(POLES)
    walk.types("python poles.py")
    page = (HOME / "docs" / "laws.md").read_text()
    walk.runs("laws.md", page[: page.index("class Controller")].count("```python\n") - 1)
    walk.types(f"pip install -q {HOME}[fmu]")
    for file in (HOME / "tests" / "fmu").glob("controller3.*"):
        shutil.copy(file, walk.folder)
    walk.types("gcc -shared -fPIC -o c.so controller3.c")
    (walk.folder / "unit.py").write_text(UNIT)
    walk.types("python unit.py")
    walk.ends()


if __name__ == "__main__":
    subprocess.run([sys.executable, "-m", "venv", "--clear", HOME / ".venv"], check=True)
    start = time.perf_counter()
    subprocess.run([BIN / "pip", "install", "-q", "--no-compile", f"{HOME}[fe,view]"], check=True)
    installed = time.perf_counter() - start
    print(f"pip: {installed:.0f} s", flush=True)
    for newcomer in (engineer, student, analyst, control):
        newcomer(installed)
