"""Who may import whom, and what works without FEniCSx."""

import ast
import os
import subprocess
import sys

import pytest

from cases.paths import ROOT

pytestmark = pytest.mark.once

HEAVY = {"dolfinx", "ufl", "basix", "ffcx", "petsc4py", "slepc4py", "mpi4py", "gmsh", "meshio"}
DRAWING = {"pyvista", "vtk", "vtkmodules", "matplotlib"}
LIGHT = {"assembly", "body", "cyclic", "eigen", "errors", "io", "mbs", "model", "parametric",
         "paths", "reduction", "rotation", "units"}  # fmt: skip
ANYTHING = {"__init__", "__main__", "cli", "doctor"}  # they stand in front
# what every part stands on, none of it above another
GROUND = {*"arguments lazy names places plausible process readable".split()}
MAY_IMPORT = {  # module or package below rom/ -> what it may import from rom beside GROUND
    **{part: {"places", "errors", "model", "rotation"} for part in GROUND},
    "arguments": {"places", "errors", "model", "rotation", "plausible"},  # numbers are doubted
    "errors": set(),
    "notebook": set(),
    "model": {"errors", "material", "notebook"},
    "decks": {"model", "errors"},
    "units": {"errors"},
    "rotation": {"errors"},
    "paths": {"model", "errors"},
    "eigen": {"model", "errors"},
    "reduction": {"model", "rows", "eigen", "errors"},
    "cyclic": {"model", "rows", "eigen", "rotation", "reduction", "errors"},
    "body": {"model", "eigen", "rotation", "notebook", "paths", "units", "errors"},
    "assembly": {"model", "rows", "eigen", "body", "reduction", "rotation", "errors"},
    "mbs": {"model", "rotation", "io", "notebook", "paths", "errors"},
    "io": {"model", "units", "body", "parametric", "updating", "errors", "decks"},
    "checks": {"model", "rows", "eigen", "body", "reduction", "errors"},
    "workflow": LIGHT | {"checks"},
    "prestress": {"model", "rows", "eigen", "rotation", "cyclic", "reduction", "errors"},
    "parametric": LIGHT | {"checks", "rows", "workflow"},
    "updating": {*"model rows body eigen assembly parametric reduction rotation errors".split()},
    "fe": {"model", "eigen", "units", "errors", "decks"},
    "components": LIGHT | {"updating"},
    "view": {"model", "mbs", "rotation", "io", "errors"},
    "fmu": {"model", "mbs", "rotation", "body", "io", "errors"},
    "config": LIGHT | {"checks", "fe", "fmu", "workflow"},
    "report": LIGHT | {"checks", "config", "view"},
    "material": {"errors", "units"},
    "rows": {"model"},
}
# inside each folder that has folders, what lies lower stands first; a file imports its own folder
# or a lower one
ORDER = {
    level: tuple(names.split())
    for level, names in {
        "": (
            "errors notebook rotation places lazy names readable process plausible "
            "arguments units material model rows paths decks eigen reduction body fe checks "
            "assembly cyclic workflow parametric updating prestress io mbs fmu view config report "
            "components doctor cli __main__"
        ),
        "cli": (
            "answer speech schemas options described method ranks matrices model output verbs "
            "parser main"
        ),
        "cyclic": (
            "faces sector rotation modes gyroscopic travelling supports campbell certificate "
            "reduced blades"
        ),
        "fe": "costs parallel jit compat operators forms mesh elasticity probe",
        "fe.operators": (
            "solver memory disk aij foreseen factor corrected substructures held spectrum "
            "iterative counting krylov_schur workers petsc"
        ),
        "fe.mesh": (
            "cell_types topology picks cad solid sources child curving quality repair validate "
            "cut distribute read summary input_deck"
        ),
        "io": (
            "files hdf5 archive native fields responses matrices sid programs fmu family history "
            "export claim ours"
        ),
        "mbs": (
            "compiler kernels parts connections elements mechanism equations results integrate "
            "analysis"
        ),
        "mbs.analysis": (
            "quadratic_eigen local_equations rotors few_modes tangent sparse_tangent equilibrium "
            "linearize campbell response snapshot steady_motion sensitivity inverse_dynamics "
            "law_check continuation periodic"
        ),
        "mbs.elements": (
            "family pair_motion cylinders springs rotational_springs loads law_calls "
            "laws_in_python laws formulas motors frictions contact stops bushings spread_loads "
            "nonlinear rods tendons gears rolling films round_bodies solids"
        ),
        "body": (
            "recovery nonlinear records inertia reference stiffening conversion frame rotating "
            "surface flexible prestress projection correction damping spread"
        ),
        "reduction": "bases interfaces full_model",
        "view": "canvas figures scenes",
    }.items()
}
MODULES = sorted((ROOT / "rom").rglob("*.py"))


def part_of(path):
    return path.relative_to(ROOT / "rom").with_suffix("").parts[0]


def imports(path):
    """(line, module) of every import in a file, functions included."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}:{node.lineno}: write absolute imports"
            if node.module == "rom":
                yield from ((node.lineno, f"rom.{alias.name}") for alias in node.names)
            else:
                yield node.lineno, node.module


def wrong(part, name):
    """What is wrong with an import, or nothing."""
    package, _, rest = name.partition(".")
    if package in HEAVY and part != "fe":
        return f"{name}; only rom.fe may"
    if package in DRAWING and part not in ("view", "report", "doctor"):
        return f"{name}; only rom.view may"
    target = rest.split(".")[0]
    if package == "rom" and part not in ANYTHING and target != part:
        if not target:
            return "the package root"
        ground = GROUND - {part} if part not in {"errors", "notebook", *GROUND} else set()
        if target not in MAY_IMPORT[part] | ground:
            return f"rom.{target}"
    return None


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(ROOT)))
def test_imports_follow_the_layers(path):
    found = [(line, wrong(part_of(path), name)) for line, name in imports(path)]
    bad = [f"{path.name}:{line} imports {what}" for line, what in found if what]
    assert not bad, "\n".join(bad)


def test_every_part_has_a_place_in_the_layers():
    assert {part_of(path) for path in MODULES} <= set(MAY_IMPORT) | ANYTHING


def level_of(parts):
    """Dotted name of a folder below rom/, "" for rom/ itself."""
    return ".".join(parts)


def upward(path, name, order):
    """What a file may not reach: a file or folder that is higher on the level where both meet."""
    own = path.relative_to(ROOT / "rom").with_suffix("").parts
    target = tuple(name.split(".")[1:])
    if name.split(".")[0] != "rom" or own[-1] == "__init__":
        return None
    same = next((k for k, (a, b) in enumerate(zip(own, target, strict=False)) if a != b), None)
    if same is None or level_of(own[:same]) not in order:
        return None
    places = order[level_of(own[:same])]
    if target[same] in places and places.index(target[same]) > places.index(own[same]):
        return f"{level_of(own[:same]) or 'rom'}: {own[same]} lies below {target[same]}"
    return None


def whole_imports(path):
    """(line, module) of every import, of modules also where a package is named first."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from ((node.lineno, f"{node.module}.{alias.name}") for alias in node.names)


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(ROOT)))
def test_no_file_imports_from_a_higher_room(path):
    """At every level, also inside functions and where only types are meant."""
    found = [(line, upward(path, name, ORDER)) for line, name in whole_imports(path)]
    bad = [f"{path.name}:{line} {what}" for line, what in found if what]
    assert not bad, "\n".join(bad)


def test_every_room_has_its_place_in_the_order():
    """A folder with folders in it says in which order they and its files lie."""
    for folder in {ROOT / "rom", *(path.parent for path in MODULES)}:
        level = level_of(folder.relative_to(ROOT / "rom").parts)
        inside = {p.stem for p in folder.glob("*.py")} - {"__init__"}
        folders = {p.parent.name for p in folder.glob("*/__init__.py")}
        if level in ORDER or (folders and level != "components"):
            assert inside | folders == set(ORDER[level]), level or "rom"


@pytest.mark.parametrize("level", ORDER)
def test_an_upward_import_is_found_on_each_level(level):
    low, high = ORDER[level][0], ORDER[level][-1]
    start = ".".join(("rom", *filter(None, [level])))
    folder = ROOT.joinpath(*start.split("."))
    file = folder / low / "x.py" if (folder / low).is_dir() else folder / f"{low}.py"
    assert upward(file, f"{start}.{high}.y", ORDER)
    assert not upward(folder / f"{high}.py", f"{start}.{low}", ORDER)


def test_components_do_not_know_who_uses_them():
    """They could leave as a package of their own; the doctor compiles them ahead."""
    for path in MODULES:
        if part_of(path) not in ("components", "doctor"):
            bad = [name for _, name in imports(path) if name.startswith("rom.components")]
            assert not bad, f"{path}: {bad}"


def circles(modules, package=ROOT / "rom"):
    """Files that import each other round and round, fronts too, as sets of dotted names."""
    parts = {path: path.relative_to(package.parent).with_suffix("").parts for path in modules}
    names = {level_of(p[:-1] if p[-1] == "__init__" else p): path for path, p in parts.items()}
    reach = {
        name: {one if one in names else one.rpartition(".")[0] for _, one in whole_imports(path)}
        for name, path in names.items()
    }
    reach = {name: near & names.keys() for name, near in reach.items()}
    for _ in range(len(names).bit_length()):
        reach = {name: near.union(*(reach[n] for n in near)) for name, near in reach.items()}
    return {frozenset(n for n in names if n in reach[name] and name in reach[n])
            for name in names if name in reach[name]}  # fmt: skip


def test_no_files_go_round_in_circles():
    """Also inside functions and where only types are meant."""
    assert not [" ".join(sorted(one)) for one in circles(MODULES)]


PLANTED = {  # files of a package, and those of them that go round
    "in functions": ({"a": "from rom import b", "b": "import rom.c", "d": "import rom.a",
                      "c": "def f():\n    from rom.a import x"}, {"rom.a", "rom.b", "rom.c"}),
    "through a front": ({"p/__init__": "from rom.p.a import x", "p/a": "import rom.b",
                         "b": "from rom.p import x"}, {"rom.p", "rom.p.a", "rom.b"}),
    "none": ({"p/__init__": "from rom.p.a import x", "p/a": "from rom.p import b",
              "p/b": "import numpy"}, None),
}  # fmt: skip


@pytest.mark.parametrize("case", PLANTED)
def test_a_circle_of_imports_is_found(case, tmp_path):
    files, round_and_round = PLANTED[case]
    package = tmp_path / "rom"
    (package / "p").mkdir(parents=True)
    for name, text in files.items():
        (package / f"{name}.py").write_text(text)
    found = circles(sorted(package.rglob("*.py")), package)
    assert found == ({frozenset(round_and_round)} if round_and_round else set())


def test_folders_hold_no_more_than_one_can_look_over():
    for folder in {path.parent for path in MODULES}:
        assert len([p for p in folder.glob("*.py") if p.name != "__init__.py"]) <= 15, folder


@pytest.mark.parametrize(
    ("part", "name"),
    [("io", "rom.fe.mesh"), ("mbs", "rom.body.flexible"), ("model", "rom"), ("fe", "rom.workflow"),
     ("cli", "dolfinx"), ("io", "meshio"), ("mbs", "matplotlib.pyplot")],
)  # fmt: skip
def test_the_rules_forbid_something(part, name):
    assert wrong(part, name)


def run_blocked(code, *, blocked):
    """Run code in a process where some packages cannot be imported."""
    block = f"import sys; sys.modules.update(dict.fromkeys({sorted(blocked)!r}))\n"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-c", block + code],
        env=environment, capture_output=True, text=True, timeout=60, check=False,
    )  # fmt: skip


def test_the_front_door_opens_without_fenicsx_and_pictures():
    """Every public name resolves where only NumPy, SciPy and Numba are installed."""
    code = "import rom\nfor name in rom.__all__: getattr(rom, name)"
    done = run_blocked(code, blocked=HEAVY | DRAWING)
    assert done.returncode == 0, done.stderr


def test_importing_rom_loads_nothing_heavy():
    """Start-up time: the command line imports rom before it knows what it is asked."""
    code = f"import rom; print(sorted(({HEAVY | DRAWING!r} | {{'numba'}}) & set(sys.modules)))"
    done = run_blocked(code, blocked=())
    assert done.stdout.strip() == "[]", done.stderr


def test_fronts_load_nothing_but_fronts():
    """Neither NumPy nor a module behind them, so that a name costs what stands behind that name."""
    stubs = (path.parent.relative_to(ROOT).parts for path in (ROOT / "rom").rglob("__init__.pyi"))
    fronts = [".".join(parts) for parts in stubs if "fe" not in parts]
    done = run_blocked(f"import sys, {', '.join(fronts)}; print(*sys.modules)", blocked=())
    loaded = set(done.stdout.split())
    own = {name for name in loaded if name.split(".")[0] == "rom"}
    assert own == {*fronts, "rom.lazy", "rom.process", "rom.process.launcher"}, done.stderr
    assert not {"numpy", "scipy", "numba"} & loaded


def test_the_mesh_checks_run_without_gmsh_and_dolfinx():
    done = run_blocked(
        "import rom.fe.mesh.validate, rom.fe.mesh, rom.fe.mesh.summary", blocked=HEAVY
    )
    assert done.returncode == 0, done.stderr


TESTS = ROOT / "tests"


def test_tests_share_what_lies_in_cases_and_nothing_else():
    for path in TESTS.rglob("*.py"):
        for name in {name.split(".")[0] for _, name in imports(path)}:
            assert not name.startswith("test_"), f"{path}: {name} is a file of tests"


def test_folders_of_tests_are_as_easy_to_look_over_as_those_of_the_package():
    assert [path.name for path in TESTS.glob("*.py")] == ["conftest.py"]
    for folder in {path.parent for path in TESTS.rglob("*.py")}:
        assert len([p for p in folder.glob("*.py") if p.name != "__init__.py"]) <= 15, folder
