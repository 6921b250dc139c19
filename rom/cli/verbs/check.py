"""Check a body file: checksums, consistency of its integrals, the certificate it carries.

A description, .toml, is read for mistakes; of any other file it is said what it is, and what to do
with it.
"""

import argparse
import re
from pathlib import Path

import rom
from rom.cli.answer import Answer, failures, report_data
from rom.cli.described import TOML_SUFFIX, described
from rom.config.document import read_document
from rom.readable import check_readable

SUMMARY = "check a body file and print its certificate"
EXAMPLES = """\
  rom check rod.rom.npz
  rom check rod.rom.npz --json
  rom check rod.SID_FEM          # which dialect, and whether its blocks agree
  rom check slider_crank.toml    # mistakes in a description, by line
  rom check part.step            # what it is, and the next command
"""
DECK = "rom mesh {} --units mm-t-s", "rom modes {} --units mm-t-s  # else --material steel"
MATRIX = (
    "a matrix of another program",
    "rom modes {} --mass MASS --nodes NODES",
    "rom reduce {} --mass MASS --nodes NODES -i NAME=rbe2",
)
MESHED = "rom mesh {}", "rom modes {} --material steel"
BODY = "rom export {} BODY.rom.npz", "rom check BODY.rom.npz"
OTHERS = (  # endings; words of which a line begins with one, if need be; what it is, next commands
    (".step .stp", "ISO", "a part of a CAD program", "rom swing {}", "rom mesh {} --faces"),
    (".py", "INTERFACES", "a reduced body for Exudyn", *BODY),
    (".fem", "**/RECORD", "a reduced body of MBDyn", *BODY),
    (".geo .py", "", "a program of gmsh", *MESHED),
    (".msh", "$MESHFORMAT", "a mesh of gmsh", *MESHED),
    (".bdf .nas .dat .fem", "CTETRA CHEXA INCLUDE", "a deck of Nastran", *DECK),
    (".inp", "*ELEMENT *INCLUDE", "a deck of Abaqus or CalculiX", *DECK),
    (".cdb", "ET NBLOCK", "an archive of Ansys", *DECK),
    (".med", "", "a mesh of Salome", *MESHED),
    (".bdf .dat .pch .dmig", "DMIG", *MATRIX),
    (".op4 .mtx .mm .sti .mas", "", *MATRIX),
    (".unv", "-1/2412", "a mesh of another program", *MESHED),
    (".unv .uff", "", "a vibration test", "rom update FAMILY {}"),
    (".json", "", "the record or the scene of a run", "rom report FOLDER"),
)
FIRST_WORDS = re.compile(r"^\s*([*$]?[A-Z]\w*|\*\* *RECORD|-1\s+2412\b)", re.M)
BODIES = (".npz", ".sid_fem")


def add_options(parser: argparse.ArgumentParser) -> None:
    """Options of the verb."""
    parser.add_argument("file", type=Path, help="body file, e.g. rod.rom.npz, or any other")


def run(args: argparse.Namespace) -> Answer:
    """Load and check."""
    from rom.io.native import load

    ending = args.file.suffix.lower()
    if ending not in BODIES:
        return _told(args.file, *(_description if described(args) else _kind)(args.file))
    if ending == ".sid_fem":
        record = rom.read_sid(args.file, ge="as_written")
        report, told = rom.io.check_sid(record), {"name": record.name, "dialect": record.dialect}
    else:
        body = load(args.file)
        report, told = rom.check(body), {"name": body.name}
    data = {"file": str(args.file), **told, "report": report_data(report)}
    return Answer(data, f"{args.file}\n{report}", failed=failures(report))


def _kind(file: Path) -> tuple[str, ...]:
    """What another file is, by its ending and what its lines begin with, and the next commands."""
    if not check_readable(file).stat().st_size:
        raise rom.FileFormatError("the file is empty.", where=str(file))
    ending, found = file.suffix.lower(), set[str]()
    rows = [row for row in OTHERS if ending in row[0].split()]
    if any(words for _, words, *_ in rows):
        text = file.read_bytes().decode("latin1")
        found = {"/".join(word.split()) for word in FIRST_WORDS.findall(text.upper())}
    for _, words, *told in rows:
        if not words or found & set(words.split()):
            return tuple(told)
    kinds = " ".join([*BODIES, TOML_SUFFIX, *(endings for endings, *_ in OTHERS)])
    wanted = " or ".join(words.replace(" ", ", ") for _, words, *_ in rows)
    text = f"is no {ending} file: no line begins with {wanted}" if rows else "is of no known kind"
    raise rom.FileFormatError(
        f"{text}.", where=str(file), hint="" if rows else f"Known are {kinds}."
    )


def _told(file: Path, what: str, *commands: str) -> Answer:
    then = [command.format(file) for command in commands]
    text = "\n".join([f"{file} is {what}. Next, for example", *(f"  {x}" for x in then)])
    return Answer({"file": str(file), "kind": what, "next": then}, text)


def _description(file: Path) -> tuple[str, ...]:
    if "bodies" in read_document(file).data:
        rom.read_mechanism(file)
        return "a mechanism without mistakes", "rom simulate {}", "rom view {}"
    rom.read_component(file)
    return "a component without mistakes", "rom reduce {}", "rom modes {}"
