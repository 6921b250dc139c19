"""Who may import whom, and what works without FEniCSx."""

import ast
import re
import tomllib
from functools import cache
from pathlib import Path

import pytest

from cases.command import ROOT, python

pytestmark = pytest.mark.once

HEAVY = {"dolfinx", "ufl", "basix", "ffcx", "petsc4py", "slepc4py", "mpi4py", "gmsh", "meshio"}
DRAWING = {"pyvista", "vtk", "vtkmodules", "matplotlib"}
ANYTHING = {"__init__", "__main__", "cli", "doctor"}  # they stand in front
GROUND = (
    "errors notebook rotation places lazy names readable process fields arguments units plausible "
    "material"
).split()
# parts that know, of all that lies below them, the ground and these alone: what moves, say, are
# arrays, whoever has made them
ALONE = {
    part: {part, *names.split(), *GROUND}
    for part, names in {
        "model": "", "eigen": "model", "reduction": "model rows eigen", "body": "model eigen paths",
        "fe": "model eigen decks", "io": "model body decks",
        "mbs": "model io paths", "view": "model mbs io", "fmu": "model mbs body io",
    }.items()
}  # fmt: skip
# inside each folder that has folders, what lies lower stands first; a file imports its own folder
# or a lower one
ORDERED = """
rom: errors rotation places fields notebook lazy names readable process plausible units arguments
  material model rows paths decks eigen reduction body fe checks stages workflow assembly cyclic
  parametric updating prestress io mbs fmu view config report doctor cli components __main__
cli: answer speech schemas options described matrices output verbs parser main
fe: costs parallel jit compat operators forms mesh elasticity probe
fe.operators: solver memory disk aij foreseen factor substructures spectrum iterative workers
  petsc
fe.mesh: cell_types topology picks cad solid ties sources child curving quality repair validate
  cut read summary input_deck
io: files archive native fields matrices sid programs fmu bodies history export ours
mbs: compiler kernels parts connections elements mechanism equations results integrate control
  analysis
mbs.analysis: local_equations rotors few_modes tangent equilibrium linearize campbell
  response steady_motion sensitivity inverse_dynamics law_check small_errors
  motion_certificate
mbs.elements: field family law_calls joint_forces springs loads laws formulas motors contact
  joint_laws bushings nonlinear solids
components.gear_mesh: gears compliance tooth_elements contact tooth_loads symbols keys field
components.wheels: faces sector rotation modes travelling reduced wheel_body blades prestress field
components.updating: frf_data measured responses airframe models methods family_model
  normal_equations verdict estimate comparison placement observers pictures verb field
components.journal_bearing: films closed_forms oil_film statics record keys field
body: recovery nonlinear records inertia reference stiffening conversion frame for_motion
  rotating surface flexible prestress projection damping spread
stages: bodies deflection
reduction: bases interfaces full_model
view: canvas figures scenes
"""
ORDER = {
    "" if level == "rom" else level: tuple(names.split())
    for level, names in re.findall(r"^(\S+): (.+(?:\n  .+)*)", ORDERED, re.M)
}
TYPES = "rom.components.methods"  # a stub alone, which is read by who checks types
MODULES, TESTS = sorted((ROOT / "rom").rglob("*.py")), ROOT / "tests"


@cache
def imports(path):
    """(line, module, name) of every import in a file, functions included; None for a module."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += ((node.lineno, alias.name, None) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: write absolute imports"
            found += ((node.lineno, node.module, alias.name) for alias in node.names)
    return found


def whole(module, name):
    """Dotted, of modules also where a package is named first."""
    return module if name is None else f"{module}.{name}"


def wrong(part, name):
    package, _, rest = name.partition(".")
    if package in HEAVY and part != "fe":
        return f"{name}; only rom.fe may"
    if package in DRAWING and part not in ("view", "report", "doctor"):
        return f"{name}; only rom.view may"
    target = rest.split(".")[0]
    if target == "components" != part and (part, name) != ("fields", TYPES):
        return "rom.components, which could leave as a package of its own"
    if package == "rom" and part not in ANYTHING and target != part:
        if not target:
            return "the package root"
        if target not in ALONE.get(part, {target}) or (target == "fe" and part != "config"):
            return f"rom.{target}"
    return None


def remarks(judge):
    said = ((path, line, judge(path, module, name)) for path in MODULES
            for line, module, name in imports(path))  # fmt: skip
    return [f"{path.relative_to(ROOT)}:{line} {what}" for path, line, what in said if what]


def test_imports_follow_the_layers_and_none_is_of_a_higher_room():
    def judge(path, module, name):
        own = path.relative_to(ROOT / "rom").with_suffix("").parts[0]
        return wrong(own, whole(module, name) if module == "rom" else module)

    assert not remarks(judge)
    assert not remarks(lambda path, module, name: upward(path, whole(module, name), ORDER))


def upward(path, name, order):
    """What a file may not reach: a file or folder that is higher on the level where both meet."""
    own = path.relative_to(ROOT / "rom").with_suffix("").parts
    target = tuple(name.split(".")[1:])
    if name.split(".")[0] != "rom" or own[-1] == "__init__" or name.startswith(TYPES):
        return None
    same = next((k for k, (a, b) in enumerate(zip(own, target, strict=False)) if a != b), None)
    level = None if same is None else ".".join(own[:same])
    if level not in order:
        return None
    places = order[level]
    if target[same] in places and places.index(target[same]) > places.index(own[same]):
        return f"{level or 'rom'}: {own[same]} lies below {target[same]}"
    return None


def test_every_room_has_its_place_in_the_order_and_can_be_looked_over():
    for folder in {ROOT / "rom", *(path.parent for path in MODULES)}:
        level = ".".join(folder.relative_to(ROOT / "rom").parts)
        inside = {p.stem for p in folder.glob("*.py")} - {"__init__"}
        folders = {p.parent.name for p in folder.glob("*/__init__.py")}
        if level in ORDER or (folders and level != "components"):
            assert inside | folders == set(ORDER[level]), level or "rom"
    assert [path.name for path in TESTS.glob("*.py")] == ["conftest.py"]
    for folder in {path.parent for path in (*MODULES, *TESTS.rglob("*.py"))}:
        assert len([p for p in folder.glob("*.py") if p.name != "__init__.py"]) <= 15, folder


def test_no_files_go_round_in_circles():
    parts = {path: path.relative_to(ROOT).with_suffix("").parts for path in MODULES}
    names = {".".join(p[:-1] if p[-1] == "__init__" else p): path for path, p in parts.items()}
    reach = {
        name: {
            one if one in names else one.rpartition(".")[0]
            for one in (whole(*found) for _, *found in imports(path))
        }
        for name, path in names.items()
    }
    reach = {name: near & names.keys() for name, near in reach.items()}
    for _ in range(len(names).bit_length()):
        reach = {name: near.union(*(reach[n] for n in near)) for name, near in reach.items()}
    assert not [name for name in names if name in reach[name]]


def test_the_newest_numba_that_was_tried_bounds_what_is_installed():
    newest = re.search(r"^numba==0\.(\d+)", (ROOT / ".ci" / "light.txt").read_text(), re.M)
    bound = f'<0.{int(newest.group(1)) + 1}"'
    assert re.search(f'"numba>=[\\d.]+,{bound}', (ROOT / "pyproject.toml").read_text())


def run_blocked(code, *, blocked):
    block = f"import sys; sys.modules.update(dict.fromkeys({sorted(blocked)!r}))\n"
    return python("-c", block + code)


@pytest.mark.parametrize(
    ("code", "blocked"),
    [("import rom\nfor name in rom.__all__: getattr(rom, name)", HEAVY | DRAWING),
     ("import rom.fe.mesh.validate, rom.fe.mesh, rom.fe.mesh.summary", HEAVY)],
    ids=["the front door", "checks of meshes"],
)  # fmt: skip
def test_what_needs_no_fenicsx_opens_without(code, blocked):
    done = run_blocked(code, blocked=blocked)
    assert done.returncode == 0, done.stderr


def test_fronts_load_nothing_but_fronts():
    stubs = (path.parent.relative_to(ROOT).parts for path in (ROOT / "rom").rglob("__init__.pyi"))
    fronts = [".".join(parts) for parts in stubs if "fe" not in parts]
    done = run_blocked(f"import sys, {', '.join(fronts)}; print(*sys.modules)", blocked=())
    loaded = set(done.stdout.split())
    own = {name for name in loaded if name.split(".")[0] == "rom"}
    assert own == {*fronts, "rom.lazy", "rom.process", "rom.process.launcher"}, done.stderr
    assert not (HEAVY | DRAWING | {"numpy", "scipy", "numba"}) & loaded


# Lines of Python per folder only fall: a number of `lines.toml` is raised with a reason beside it.
LIMITS = tomllib.loads(Path(__file__).with_name("lines.toml").read_text())
DEEPER = ("rom", "rom/components", "rom/mbs")  # told folder by folder


def lines(place):
    """Of all files below a folder, or of those that a pattern names."""
    found = ROOT.glob(place) if "*" in place else (ROOT / place).rglob("*.py")
    return sum(len(path.read_bytes().splitlines()) for path in found)


def folders():
    """The places that have a number: the sums, folders, and files that lie in none of these."""
    inside = {p for d in DEEPER for p in (ROOT / d).iterdir() if any(p.rglob("*.py"))}
    named = {p.relative_to(ROOT).as_posix() for p in inside if p.is_dir()}
    return {"tests", "rom"} | {f"{d}/*.py" for d in DEEPER} | (named - set(DEEPER))


def test_no_folder_grows_beyond_its_lines():
    assert set(LIMITS) == folders()
    grown = {place: lines(place) for place in LIMITS if lines(place) > LIMITS[place]}
    assert not grown, f"more lines than in lines.toml: {grown}"
