"""The grammar of the command line, with the exit codes and examples that ``--help`` shows."""

import argparse
from collections.abc import Sequence
from contextlib import suppress
from types import ModuleType
from typing import NoReturn

from rom import fields
from rom.cli.answer import to_json
from rom.cli.options import options_of, verb_parsers
from rom.cli.schemas import schema
from rom.cli.speech import say
from rom.config.keys import nearest
from rom.errors import ConfigError, UnknownNameError

VERBS = "doctor demo open mesh modes reduce check export simulate view report swing".split()
LAST_VERBS = ["bench", "completion"]  # behind those of fields
EXIT_CODES = """\
exit codes:
  0  done
  1  a mistake of ours, please report it
  2  usage: an option, a name or an output place that cannot be
  3  an input file or mesh that is not what it should be
  4  physics: material, interface or mechanism that cannot be
  5  a solver did not deliver, or a quality figure is beyond its limit
  6  not enough memory or disk, or a library is missing
  7  interrupted; what was finished before is kept
"""
LONGEST_MESSAGE = 500  # letters of what the parser says
EXAMPLES = """\
examples:
  rom doctor
  rom demo --copy                  # meshes/ and demos/ of these examples
  rom mesh meshes/connecting_rod.geo -p lc=4e-3
  rom reduce meshes/connecting_rod.geo --E 210e9 --nu 0.3 --rho 7850 \\
      -i pin_a=rbe2 -i pin_b=rbe2 -m 20 --reference pin_a -o rod.rom.npz
  rom check rod.rom.npz
  rom VERB --help has more for each verb
"""


class ShowSchema(argparse.Action):
    """Prints the JSON Schema of the answer of a verb and leaves, whatever else is missing."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        """Print and leave."""
        say(to_json(schema(parser.prog.split()[-1])))
        parser.exit()


class Parser(argparse.ArgumentParser):
    """Reports what it does not understand as a `ConfigError` with the nearest thing it knows."""

    def error(self, message: str) -> NoReturn:
        """Raise instead of printing the usage and leaving."""
        hint = f"{self.prog} --help lists what there is."
        if len(message) > LONGEST_MESSAGE:  # it quotes what was typed
            message = f"{message[:LONGEST_MESSAGE]}..."
        if "expected one argument" in message:
            option = message.split()[1].rstrip(":")
            hint = f"Write {option}=-1 where the value begins with a minus. {hint}"
        raise ConfigError(f"{message}.", hint=hint)

    def parse_args(  # type: ignore[override]  # one signature for its three overloads
        self, args: Sequence[str] | None = None, namespace: argparse.Namespace | None = None
    ) -> argparse.Namespace:
        """Parse, and suggest a spelling for an option that does not exist."""
        found, unknown = self.parse_known_args(args, namespace)
        if unknown:
            known = options_of(verb_parsers(self).get(found.verb, self))
            hint = nearest(unknown[0].partition("=")[0], known)
            raise ConfigError(f"unknown option or argument {unknown[0]!r}.", hint=hint)
        return found

    def _check_value(self, action: argparse.Action, value: object) -> None:
        if action.choices is not None and value not in action.choices:
            fields.find("verbs", str(value))  # of a field that is not here
            hint = nearest(str(value), action.choices)
            raise ConfigError(f"the {action.dest} {str(value)!r} does not exist.", hint=hint)


def given(argv: list[str]) -> dict[str, object]:
    """Only the options that a command line says, by their destination."""
    parser = build_parser()
    for sub in verb_parsers(parser).values():
        for action in sub._actions:
            action.default = argparse.SUPPRESS
    return dict(vars(parser.parse_args(argv)))


def verb_modules() -> dict[str, ModuleType]:
    """{verb: its module}, those of fields too, which take none of the program."""
    own = {name: fields.follow(f"rom.cli.verbs.{name}") for name in (*VERBS, *LAST_VERBS)}
    given = {}
    for name in fields.names("verbs"):
        with suppress(UnknownNameError):
            given[name] = fields.find("verbs", name)
    return {name: own[name] for name in VERBS} | given | own


def build_parser() -> Parser:
    """The whole grammar; loads nothing heavy."""
    parser = Parser(
        prog="rom",
        description="From a gmsh geometry to a reduced flexible body that moves.",
        epilog=EXAMPLES + "\n" + EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="store_true", help="print the version and leave")
    add_common(parser, default=False)
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", title="verbs", parser_class=Parser)
    for name, module in verb_modules().items():
        sub = verbs.add_parser(
            name,
            help=module.SUMMARY,
            description=module.__doc__,
            epilog=f"examples:\n{module.EXAMPLES}\n{EXIT_CODES}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
            allow_abbrev=False,
        )
        module.add_options(sub)
        sub.add_argument(
            "--json-schema", action=ShowSchema, nargs=0, help="print what --json holds, and leave"
        )
        add_common(sub, default=argparse.SUPPRESS)
        sub.set_defaults(run=module.run, parser=parser)
    return parser


def add_common(parser: argparse.ArgumentParser, default: object) -> None:
    """Options that may stand before or behind the verb."""
    group = parser.add_argument_group("for every verb")
    for flags, text in (
        (("--json",), "print one JSON object, also for an error"),
        (("-q", "--quiet"), "no progress, no warnings"),
        (("-v", "--verbose"), "more progress"),
        (("--strict",), "a warning is an error (exit code 5)"),
        (("--debug",), "show where in the program an error arose"),
    ):
        group.add_argument(*flags, action="store_true", default=default, help=text)
