"""Who may import whom, and what works without FEniCSx."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HEAVY = {"dolfinx", "ufl", "basix", "ffcx", "petsc4py", "slepc4py", "mpi4py", "gmsh", "meshio"}
DRAWING = {"pyvista", "vtk", "vtkmodules", "matplotlib"}
LIGHT = {"attachment", "body", "cyclic", "eigen", "errors", "io", "mbs", "model", "parameters",
         "reduction", "rotation", "rows", "scipy_operators", "units"}  # fmt: skip
ANYTHING = {
    "__init__",
    "__main__",
    "bench",
    "bench_loops",
    "bench_models",
    "bench_wheel",
    "child_entry",
    "cli",
    "doctor",
    "peers",
}  # they stand in front
# what every part stands on, none of it above another
GROUND = {
    "arguments",
    "child",
    "deprecated",
    "interruption",
    "launcher",
    "memory",
    "names",
    "plausible",
}
MAY_IMPORT = {  # module or package below rom/ -> what it may import from rom beside GROUND
    **{part: {"errors", "interruption", "model", "rotation"} for part in GROUND},
    "errors": set(),
    "notebook": set(),
    "material": {"errors", "units"},
    "model": {"errors", "material", "notebook"},
    "units": {"errors"},
    "rotation": {"errors"},
    "eigen": {"model", "errors"},
    "attachment": {"model", "eigen", "errors"},
    "scipy_operators": {"model", "eigen", "errors"},
    "reduction": {"model", "eigen", "scipy_operators", "errors"},
    "parameters": {"model", "errors"},
    "cyclic": {
        "model",
        "eigen",
        "rotation",
        "scipy_operators",
        "attachment",
        "reduction",
        "rows",
        "errors",
    },
    "body": {
        "model",
        "eigen",
        "rotation",
        "attachment",
        "parameters",
        "notebook",
        "rows",
        "units",
        "errors",
    },
    "mbs": {"model", "rotation", "io", "notebook", "errors"},
    "io": {"model", "units", "body", "parameters", "errors"},
    "rows": {"model"},
    "checks": {"model", "eigen", "body", "rows", "scipy_operators", "errors"},
    "certificate": {"model", "eigen", "body", "reduction", "rows", "errors"},
    "workflow": LIGHT | {"certificate"},
    "prestress": {
        "model",
        "eigen",
        "rotation",
        "scipy_operators",
        "cyclic",
        "reduction",
        "rows",
        "errors",
    },
    "parametric": LIGHT | {"certificate", "rows", "workflow"},
    "fe": {"model", "eigen", "units", "scipy_operators", "errors"},
    "components": LIGHT,
    "view": {"model", "mbs", "rotation", "io", "errors"},
    "fmu": {"model", "mbs", "rotation", "body", "io", "errors"},
    "config": LIGHT | {"checks", "fe", "report", "view", "workflow"},
    "report": {"model", "mbs", "view", "io", "errors"},
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


def test_the_mesh_checks_run_without_gmsh_and_dolfinx():
    done = run_blocked(
        "import rom.fe.mesh.validate, rom.fe.mesh, rom.fe.mesh.summary", blocked=HEAVY
    )
    assert done.returncode == 0, done.stderr
