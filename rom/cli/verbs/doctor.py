"""Say which versions are installed, what works, and what to type for the rest.

Exit code 0 also when an optional part is missing; 5 when something is installed and does not work.
With --compile, what is compiled at first use is compiled now, and 5 says that something cannot be.
"""

import argparse
import logging
from dataclasses import asdict

import rom
from rom.cli.answer import Answer
from rom.cli.options import option
from rom.doctor.probes import Finding, compiled, start

log = logging.getLogger("rom")
SUMMARY = "versions, speed of the linear algebra, display, caches, advice"
EXAMPLES = """\
  rom doctor
  rom doctor --fix            # also remove what killed runs left in the caches
  rom doctor --compile        # compile now, on all cores, what the first use would wait for
  rom doctor --compile demo   # only what `make demo` and the first page of the manual need
"""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    option(parser, "--fix", "remove damaged files from the caches")
    about = "compile what is not yet; with 'demo' only what first motions need"
    option(parser, "--compile demo", about, str, nargs="?", const="all", choices=("all", "demo"))


def run(args: argparse.Namespace) -> Answer:
    """Examine and report."""
    found = _compiled(args.compile) if args.compile else _diagnosed(args.fix)
    broken = tuple(f"{f.name} is broken: {f.value}" for f in found if f.state == "broken")
    data = {"rom": rom.__version__, "findings": [asdict(f) for f in found]}
    return Answer(data, f"rom {rom.__version__}\n{_text(found)}", failed=broken)


def _diagnosed(fix: bool) -> list[Finding]:
    """Findings in the order of the report; what could crash runs in a process of its own."""
    from rom.doctor import libraries

    fe = start("rom.fe.probe", *(["--fix"] if fix else []))
    drawing = start("rom.doctor.libraries")
    found, answers = libraries.light(), fe.answer()
    return [
        *found,
        *libraries.fenicsx(answers, fe.ending),
        *libraries.blas(answers.get("mapped", {}).get("value", [])),
        *libraries.pictures(drawing.answer(), drawing.ending),
        *libraries.caches(answers.get("forms", {}), fix=fix),
        *libraries.machine(),
    ]


def _compiled(what: str) -> list[Finding]:
    from rom.doctor import first_use

    cases = first_use.DEMO_CASES if what == "demo" else tuple(first_use.CASES)
    found = {}
    for finding in compiled(first_use.MODULE_NAME, cases):
        found[finding.name] = finding
        log.info("%d of %d, %s: %s", len(found), len(cases), finding.name, finding.value)
    return [found[case] for case in cases]


def _text(found: list[Finding]) -> str:
    width, lines, topic = max(len(f.name) for f in found), [], ""
    for f in found:
        if f.topic != topic:
            topic = f.topic
            lines += ["", topic]
        state = "" if f.state == "ok" else f"{f.state}: "
        lines.append(f"  {f.name:<{width}}  {state}{f.value}")
        if f.advice:
            lines.append(f"  {'':<{width}}    -> {f.advice}")
    return "\n".join(lines)
