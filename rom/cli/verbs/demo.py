"""List the demos that come with rom, run one, or copy it to start from.

A demo is one script, which ends in numbers and what they should be; exit code 5 if they differ.
"""

import argparse
import re
import shutil
import sys
from contextlib import redirect_stdout
from pathlib import Path
from runpy import run_path

from rom.cli.answer import Answer, Data
from rom.cli.options import option
from rom.cli.output import add_force, checked, claim
from rom.config.examples import examples
from rom.errors import ConfigError
from rom.names import check_known

SUMMARY = "list, run or copy the demos"
EXAMPLES = """\
  rom demo                          # all of them, with what each needs and how long it takes
  rom demo slider_crank -o here     # runs it
  rom demo slider_crank --copy      # demos/demo_slider_crank.py, and its geometries in meshes/
  rom demo --copy -o tries          # all demos, and all geometries and files of mechanisms
"""
ABOUT = re.compile(r"# # (?P<title>.+)\n(?:#.*\n)*# Time: (?P<time>.+)\n")
WRITTEN = re.compile(r'\bout / "([\w.]+)"')  # what a demo names in the folder of its results


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("name", metavar="NAME", nargs="?", help="a demo; without one, list them")
    about = "folder, made if missing (default: NAME_demo; of --copy this one)"
    option(parser, "-o --output", about, Path)
    option(parser, "--copy", "copy the script and its geometries; without NAME, all there are")
    add_force(parser)


def run(args: argparse.Namespace) -> Answer:
    """List, copy, or run."""
    scripts = {name[5:-3]: path for name, path in examples("demo_*.py").items()}
    if args.name is not None:
        check_known(args.name, scripts, f"no demo is called {args.name!r}; there are")
    if args.copy:
        return _copied(args, scripts.get(args.name))
    return _listed(scripts) if args.name is None else _run(args, scripts[args.name])


def _listed(scripts: dict[str, Path]) -> Answer:
    about: Data = {}
    for name, script in scripts.items():
        text = script.read_text("utf-8")
        needs = "FEniCSx, pictures" if "mpi4py" in text else "pictures"
        about[name] = {"needs": needs} | next(ABOUT.finditer(text)).groupdict()
    line = "{0:21}{time:>7}  {needs:19}{title}".format
    return Answer({"demos": about}, "\n".join(line(name, **one) for name, one in about.items()))


def _copied(args: argparse.Namespace, script: Path | None) -> Answer:
    text = "" if script is None else script.read_text("utf-8")
    targets = {
        (args.output or Path()) / path.parent.name / name: path
        for name, path in examples("*.*").items()
        if script in (None, path) or (path.suffix != ".py" and name in text)
    }
    for target, path in [*targets.items()]:
        if target.exists() and target.read_bytes() == path.read_bytes():
            del targets[target]
        elif target.exists() and not args.force:
            text = f"{target} is there already, and differs from the one of rom"
            raise ConfigError(f"{text}; choose another folder, or replace it with --force.")

    def write() -> None:
        for target, path in targets.items():
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(path, target)

    files = [str(target) for target in targets]
    return Answer({"files": files}, "\n".join(files) or "All of them are there.", write)


def _run(args: argparse.Namespace, script: Path) -> Answer:
    args.output = args.output or Path(f"{args.name}_demo")
    claim(args)
    for name in WRITTEN.findall(script.read_text("utf-8")):
        checked(args, args.output / name)
    before = sys.argv
    sys.argv = [str(script), "--out", str(args.output), *["--quiet"] * args.quiet]
    try:
        with redirect_stdout(sys.stderr if args.json else sys.stdout):
            results = run_path(str(script), run_name="__main__")["results"]
    finally:
        sys.argv = before
    keys = "value", "expected", "tolerance"
    numbers = {name: dict(zip(keys, map(float, row), strict=True)) for name, row in results.items()}
    failed = tuple(
        f"{name} = {x['value']:.6g}, expected {x['expected']:.6g} within {x['tolerance']:g}"
        for name, x in numbers.items()
        if not abs(x["value"] - x["expected"]) <= x["tolerance"] * abs(x["expected"])
    )
    files = sorted(str(path) for path in args.output.iterdir() if path.name[0] != ".")
    held = f"{len(numbers) - len(failed)} of {len(numbers)} numbers are as expected."
    text = "\n".join([held, *files, f"To change it: rom demo {args.name} --copy"])
    return Answer({"results": numbers, "files": files}, text, failed=failed)
