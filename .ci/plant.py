"""Plant a wrong sign and a wrong factor in every file of kernels, and see whether a test turns red.

``.venv/bin/python .ci/plant.py [PART OF A PATH ...] [--seed N] [--per-file N]`` copies the package,
changes one operator or number at a time in compiled functions of the copy, and runs the tests that
belong to the file until one fails. Survivors are listed at the end with their lines; exit code 1 if
there are any. Hours for all files, minutes for one. ``--draw N`` plants N mistakes instead, in
kernels, formulas, readers and solvers in turn, each in a file drawn at random; transposed matrices
too; ``--skip N`` goes on behind the first N, where a run of hours was ended.
"""

import argparse
import ast
import functools
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

MOST_SECONDS = 3600  # of the tests of one mistake
KINDS = ("sign", "factor", "transposition")
ROOT = Path(__file__).resolve().parents[1]
DECORATORS = ("inner", "kernel", "spliced", "stage", "residuals", "tangents", "energy", "law",
              "multiplier_columns")  # fmt: skip
# of imports without which a file has none of them
MARKS = "compiled import|compiled_law|element_calls|kernels.stages"
# of which sums and multiples are no numbers
LISTS = (ast.List, ast.Tuple, ast.JoinedStr, ast.ListComp, ast.Dict)
# {part of a path: test files and folders that belong to it, the likeliest first}
TESTS = {
    "rom/mbs/elements/contact": ["tests/mbs/elements/test_mbs_contact.py"],
    "rom/mbs/elements/laws": ["tests/mbs/elements/test_mbs_laws.py"],
    "rom/mbs/elements/bushings": ["tests/mbs/elements/test_mbs_bushings.py"],
    "rom/mbs/elements/loads": ["tests/mbs/elements/test_mbs_spread_loads.py"],
    "rom/mbs/elements/solids": ["tests/body/test_large_stress.py", "tests/mbs/elements/solids"],
    "rom/mbs/elements/nonlinear": ["tests/components/cosserat"],
    "rom/components/cosserat": ["tests/components/cosserat"],
    "rom/components/gear_mesh/gears": ["tests/mbs/elements/gears"],
    "rom/components/round_bodies/cylinders": ["tests/mbs/elements/gears/test_mbs_gear_rims.py"],
    "rom/components/journal_bearing/films": ["tests/mbs/elements/films"],
    "rom/components/round_bodies": ["tests/mbs/elements/test_mbs_round_bodies.py"],
    "rom/components/rolling_bearing": ["tests/mbs/elements/test_mbs_rolling.py"],
    "rom/components/tendons": ["tests/mbs/elements/test_mbs_tendons.py"],
    "rom/mbs/elements/": ["tests/mbs/elements/test_mbs_joint_forces.py", "tests/mbs"],
    "rom/mbs/kernels/constraints": ["tests/mbs/joints", "tests/mbs"],
    "rom/mbs/results/": ["tests/mbs/integrate/test_mbs_audit.py", "tests/mbs"],
    "rom/mbs/kernels/second_order": [
        "tests/mbs/published/test_mbs_stiffening.py",
        "tests/mbs/equations",
    ],
    "rom/mbs/integrate/step_control": ["tests/mbs/integrate/test_mbs_adaptive.py"],
    "rom/mbs/integrate/": ["tests/mbs/integrate"],
    "rom/mbs/analysis/": ["tests/mbs/analysis", "tests/mbs/published"],
    "rom/mbs/": ["tests/mbs/equations", "tests/mbs/joints", "tests/mbs/published", "tests/mbs"],
    "rom/components/wheels/prestress": ["tests/prestress"],
    "rom/components/wheels": ["tests/cyclic", "tests/prestress"],
    "rom/components/families": ["tests/parametric"],
    "rom/components/orbits": ["tests/mbs/analysis"],
    "rom/components/updating": ["tests/updating", "tests/components/updating"],
    "rom/body": ["tests/body", "tests/ground"],
    "rom/fe/operators": ["tests/fe", "tests/eigen"],
    "rom/eigen": ["tests/eigen", "tests/reduction", "tests/body"],
    "rom/checks": ["tests/body", "tests/reduction"],
    "rom/stages": ["tests/body", "tests/reduction"],
    "rom/paths": ["tests/mbs/analysis", "tests/body"],
    "rom/decks": ["tests/io", "tests/fe"],
}
AREAS = {  # folders from which mistakes are drawn; kernels are all files with compiled functions
    "kernels": (),
    "formulas": ("rom/components", "rom/body", "rom/reduction", "rom/assembly", "rom/checks"),
    "readers": ("rom/io", "rom/decks", "rom/fe/mesh", "rom/components/updating/responses"),
    "solvers": ("rom/eigen", "rom/fe/operators", "rom/mbs/equations", "rom/mbs/analysis"),
}


def files() -> list[Path]:
    """All files with compiled functions."""
    texts = {path: path.read_text() for path in (ROOT / "rom").rglob("*.py")}
    kernels = (path for path, text in texts.items() if re.search(MARKS, text))
    return sorted(path for path in kernels if any(places(texts[path])))


def places(text: str, everywhere: bool = False) -> tuple[list[ast.AST], ...]:
    """Sums and differences, products, and transposed matrices, indices left out.

    Of compiled functions; everywhere: of all.
    """
    signs: list[ast.AST] = []
    factors: list[ast.AST] = []
    turned: list[ast.AST] = []
    tree = ast.parse(text)
    laws = {node.args[0].id for node in ast.walk(tree) if _compiles_a_law(node)}
    for function in ast.walk(tree):
        if not isinstance(function, ast.FunctionDef):
            continue
        if not (everywhere or function.name in laws or _compiled(function)):
            continue
        indices = {id(x) for node in ast.walk(function) if isinstance(node, ast.Subscript)
                   for x in ast.walk(node.slice)}  # fmt: skip
        for node in ast.walk(function):
            if isinstance(node, ast.AugAssign) and isinstance(node.op, ast.Add | ast.Sub):
                signs += [node] if _real(node.value) else []
            if isinstance(node, ast.Attribute) and node.attr == "T" and everywhere:
                turned.append(node)
            if not isinstance(node, ast.BinOp) or id(node) in indices:
                continue
            if everywhere and any(isinstance(x, LISTS) for x in (node.left, node.right)):
                continue
            if isinstance(node.op, ast.Add | ast.Sub) and _real(node):
                signs.append(node)
            elif isinstance(node.op, ast.Mult | ast.Div) and _real(node) and not _tolerance(node):
                factors.append(node)
    return signs, factors, turned


def _compiled(function: ast.FunctionDef) -> bool:
    named = {x.id for d in function.decorator_list for x in ast.walk(d) if isinstance(x, ast.Name)}
    return bool(named & set(DECORATORS))


def _compiles_a_law(node: ast.AST) -> bool:
    return (isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
            and node.func.id == "compiled_law" and isinstance(node.args[0], ast.Name))  # fmt: skip


def _real(node: ast.AST) -> bool:
    """Not a count: whole numbers alone count."""
    numbers = [x.value for x in ast.walk(node) if isinstance(x, ast.Constant)]
    return not numbers or any(isinstance(x, float) for x in numbers)


def _tolerance(node: ast.AST) -> bool:
    """What is merely compared with: twice of it is no mistake in a formula."""
    return any(x.id.endswith("TOL") for x in ast.walk(node) if isinstance(x, ast.Name))


def planted(text: str, node: Any) -> str:
    """The text with the sign of the right side turned, or a product doubled."""
    lines = text.splitlines(keepends=True)

    def at(line: int, column: int) -> int:
        before = sum(len(x) for x in lines[: line - 1])
        return before + len(lines[line - 1].encode()[:column].decode())

    begin, end = at(node.lineno, node.col_offset), at(node.end_lineno, node.end_col_offset)
    if isinstance(node, ast.Attribute):
        return f"{text[:begin]}({ast.get_source_segment(text, node.value)}){text[end:]}"
    mark = {ast.Add: "-", ast.Sub: "+"}.get(type(node.op))
    if isinstance(node, ast.AugAssign):
        value = ast.get_source_segment(text, node.value)
        return f"{text[:begin]}{ast.unparse(node.target)} {mark}= ({value}){text[end:]}"
    left, right = ast.get_source_segment(text, node.left), ast.get_source_segment(text, node.right)
    changed = f"(({left}) {mark} ({right}))" if mark else f"(2.0 * ({ast.unparse(node)}))"
    return text[:begin] + changed + text[end:]


def tests_of(path: str) -> list[str]:
    """The tests that belong to a file; in each folder those in front that share rare words."""
    parts = path.split("/")
    own = f"tests/components/{parts[2]}" if parts[1] == "components" else f"tests/{parts[1]}"
    listed = next((tests for part, tests in TESTS.items() if path.startswith(part)), None)
    listed = listed or [own if (ROOT / own).exists() else "tests"]
    known, here = words_of_tests(), words((ROOT / path).read_text())
    rare = {word: 1 / sum(word in others for others in known.values()) for word in here
            if any(word in others for others in known.values())}  # fmt: skip
    found: list[str] = []
    for place in listed:
        some = [test for test in known if test.startswith(place)]
        found += sorted(some, key=lambda test: -sum(rare[w] for w in here & known[test]))
    return list(dict.fromkeys(found))


def words(text: str) -> set[str]:
    """The words of a program, names in the plural and words of names too."""
    return set(re.findall(r"[a-z]{4,}", text.lower()))


@functools.cache
def words_of_tests() -> dict[str, set[str]]:
    """The words of each file of tests."""
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    return {path.relative_to(ROOT).as_posix(): words(path.read_text()) for path in files}


def drawn(n: int, seed: int) -> list[tuple[str, str, Any]]:
    """(file, kind, place) of n mistakes, area by area, in files drawn at random."""
    chance, found = random.Random(seed), []
    kernels = {path.relative_to(ROOT).as_posix() for path in files()}
    others = {path.relative_to(ROOT).as_posix() for path in (ROOT / "rom").rglob("*.py")} - kernels
    areas = {area: sorted(path for path in others if path.startswith(folders)) if folders else
             sorted(kernels) for area, folders in AREAS.items()}  # fmt: skip
    while len(found) < n:
        area = [*areas][len(found) % len(areas)]
        path = chance.choice(areas[area])
        kinds = zip(KINDS, places((ROOT / path).read_text(), area != "kernels"), strict=True)
        if there := [(kind, nodes) for kind, nodes in kinds if nodes]:
            kind, nodes = chance.choice(there)
            found.append((path, kind, chance.choice(nodes)))
    return found


def listed(given: argparse.Namespace) -> list[tuple[str, str, Any]]:
    """(file, kind, place) of so many mistakes in each file of kernels."""
    found = []
    for path in files():
        name, text = str(path.relative_to(ROOT)), path.read_text()
        if given.parts and not any(part in name for part in given.parts):
            continue
        for kind, nodes in zip(KINDS[:2], places(text)[:2], strict=True):
            chance = random.Random(f"{given.seed} {name} {kind}")  # the same ones each time
            some = chance.sample(nodes, min(given.per_file, len(nodes)))
            found += [(name, kind, node) for node in some]
    return found


def copied(folder: Path) -> None:
    """The package, and the programs that tests share with it."""
    for part in ("rom", "benchmarks"):
        if (ROOT / part).exists():
            shutil.copytree(ROOT / part, folder / part)


def first_red(folder: Path, *tests: str) -> str:
    """The first test that fails with the copy of the package in a folder; nothing if none does."""
    command = [sys.executable, "-P", "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider",
               "-o", f"pythonpath={folder} tests", *tests]  # fmt: skip
    environment = os.environ | {"PYTHONPATH": str(folder)}
    try:
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True,
                              timeout=MOST_SECONDS, check=False)  # fmt: skip
    except subprocess.TimeoutExpired:
        return tests[0]
    failed = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", done.stdout, re.M)
    return (failed[1] if failed else tests[0]) if done.returncode else ""


def survives(folder: Path, path: str, text: str, most: int | None) -> bool:
    """Whether tests of a file, in so many files at most, stay green with another text in its place.

    The copy stays for all mistakes, with what is compiled: kernels know the sources they are made
    of, whichever file these are in. A test that turns red must pass without the mistake.
    """
    (folder / path).write_text(text)
    red = first_red(folder, *tests_of(path)[:most])
    shutil.copy2(ROOT / path, folder / path)
    if red and first_red(folder, red):
        sys.exit(f"{red} fails without any mistake")
    return not red


def main() -> int:
    """Plant, run, and list what nobody noticed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", help="of paths; all files of kernels without any")
    parser.add_argument("--seed", type=int, default=0, help="of the choice of places")
    parser.add_argument("--per-file", type=int, default=1, help="signs and factors in each file")
    parser.add_argument("--draw", type=int, default=0, help="mistakes drawn over all areas")
    parser.add_argument("--skip", type=int, default=0, help="mistakes that have been tried")
    parser.add_argument("--files", type=int, help="of tests for each mistake, the nearest")
    given, survivors = parser.parse_args(), []
    chosen = (drawn(given.draw, given.seed) if given.draw else listed(given))[given.skip :]
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        copied(folder)
        for name, kind, node in chosen:
            alive = survives(folder, name, planted((ROOT / name).read_text(), node), given.files)
            line = f"{name}:{node.lineno}: {kind} of {ast.unparse(node)}"
            sys.stdout.write(f"{'SURVIVES' if alive else 'red     '} {line}\n")
            sys.stdout.flush()
            survivors += [line] if alive else []
    sys.stdout.write(f"{len(chosen)} planted, {len(survivors)} survive\n")
    return int(bool(survivors))


if __name__ == "__main__":
    sys.exit(main())
