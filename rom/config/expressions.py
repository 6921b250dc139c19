"""Formulas in a file: a closed grammar of numbers, names and functions, read but never executed.

A formula has numbers, variables of its place, constants of its table, pi, ``+ - * / ^`` (``**`` is
the same), parentheses and the functions of `rom.mbs.elements.formulas.codes.FUNCTIONS`. Python
parses it, of which only the tree is used; what comes out are instructions for
`rom.mbs.elements.formulas`. Everything is a floating-point number, so that no power fills memory.
"""

import ast
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, NoReturn

from rom.arguments import Quantity
from rom.config.document import Values
from rom.config.keys import Key, Named, Place, Plain, Table, Text, nearest, read_value, written
from rom.mbs.elements.formulas.codes import (
    ADD,
    DIV,
    FUNCTIONS,
    MAX_STACK,
    MUL,
    NEG,
    NUMBER,
    POW,
    SUB,
    VARIABLES,
    Code,
    depth,
)
from rom.units import NUMBER as QUANTITY_NUMBER
from rom.units import in_si

MAX_LETTERS = 1000  # of a formula
MAX_DEPTH = 200  # of the tree
WINDOW_SIZE = 30  # letters of a formula on either side of what is wrong in it
TOKEN_PATTERN = re.compile(
    r"(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)|(?P<word>[A-Za-z_][A-Za-z_0-9]*)"
    r"|(?P<sign>\*\*|[-+*/^(),])|(?P<blank>[ \t\r\n]+)"
)
OPERATORS = {ast.Add: ADD, ast.Sub: SUB, ast.Mult: MUL, ast.Div: DIV, ast.Pow: POW}
CONSTANTS = {"pi": math.pi}


class Token(NamedTuple):
    """A word, number, sign or blank of a formula, and where it begins."""

    kind: str
    text: str
    at: int


@dataclass(frozen=True, slots=True)
class Reader:
    """A formula at its place in a file."""

    text: str
    variables: tuple[str, ...]  # names it may have
    constants: Mapping[str, float]  # values of the other names
    place: Place

    @property
    def names(self) -> list[str]:
        """All that may stand in it."""
        return [*self.variables, *self.constants, *CONSTANTS, *FUNCTIONS]

    def code(self) -> Code:
        """Its instructions."""
        if len(self.text) > MAX_LETTERS:
            raise self.place.error(
                f"{self.place.name} has {len(self.text)} letters; {MAX_LETTERS} are the most.",
                "Give a table of points, or a function in Python.",
            )
        tokens = list(self._tokens())
        code = tuple(self._walk(self._tree(tokens), 0))
        if depth(code) > MAX_STACK:
            self._refuse(0, f"it needs more than {MAX_STACK} intermediate results at once")
        return code

    def _refuse(self, at: int, what: str, hint: str = "") -> NoReturn:
        """Raise an error with the formula and a caret below the place."""
        first, last = max(0, at - WINDOW_SIZE), min(len(self.text), at + WINDOW_SIZE)
        before, behind = "..." * (first > 0), "..." * (last < len(self.text))
        letters = (x if x.isprintable() else " " for x in self.text[first:last])
        line = before + "".join(letters) + behind  # each letter in its place
        caret = " " * (len(before) + at - first) + "^"
        message = f"{self.place.name}: {what}.\n    {line}\n    {caret}"
        raise self.place.error(message, hint)

    def _tokens(self) -> Iterator[Token]:
        at, before = 0, Token("blank", "", 0)
        while at < len(self.text):
            found = TOKEN_PATTERN.match(self.text, at)
            if found is None:
                known = f"Known: + - * / ^ ( ) , {', '.join(self.names)}."
                self._refuse(at, f"{self.text[at]!r} has no meaning here", known)
            token = Token(str(found.lastgroup), found[0], at)
            if before.kind == "number" and token.kind in ("number", "word"):
                self._refuse(at, f"a sign is missing between {before.text} and {token.text}")
            if token.kind == "word" and token.text not in self.names:
                self._refuse(at, f"there is no {token.text!r}", nearest(token.text, self.names))
            yield token
            at, before = found.end(), token

    def _tree(self, tokens: list[Token]) -> ast.expr:
        """The tree, each node of which has its ``col_offset`` in the text as written."""
        if all(token.kind == "blank" for token in tokens):
            raise self.place.error(f"{self.place.name} is empty.", "Write 0 for nothing.")
        python, places = "", []
        for token in tokens:
            word = {"^": "**"}.get(token.text, " " * len(token.text) * (token.kind == "blank"))
            word = word or token.text
            places += [min(token.at + k, token.at + len(token.text) - 1) for k in range(len(word))]
            python += word
        blanks = len(python) - len(python.lstrip())
        try:
            tree = ast.parse(python.lstrip(), mode="eval").body
        except SyntaxError as error:
            at = min((error.offset or 1) - 1 + blanks, len(places) - 1)
            self._refuse(places[at], f"this is no formula: {error.msg}")
        except (MemoryError, RecursionError, ValueError):
            self._refuse(0, "it is nested too deeply")
        for node in ast.walk(tree):
            if isinstance(node, ast.expr):
                node.col_offset = places[node.col_offset + blanks]
        return tree

    def _walk(self, node: ast.expr, level: int) -> Iterator[tuple[int, float]]:
        """The instructions of a node; the arguments of a function come before it."""
        if level > MAX_DEPTH:
            self._refuse(node.col_offset, f"it is nested deeper than {MAX_DEPTH} levels")
        if isinstance(node, ast.Constant):
            yield NUMBER, self._number(node)
        elif isinstance(node, ast.Name):
            yield self._name(node)
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.UAdd | ast.USub):
            yield from self._walk(node.operand, level + 1)
            if isinstance(node.op, ast.USub):
                yield NEG, 0.0
        elif isinstance(node, ast.BinOp) and type(node.op) in OPERATORS:
            yield from self._walk(node.left, level + 1)
            yield from self._walk(node.right, level + 1)
            yield OPERATORS[type(node.op)], 0.0
        elif isinstance(node, ast.Call):
            yield from self._call(node, level)
        else:
            what = "a comma stands between arguments of a function only"
            other = "this is nothing a formula has"
            self._refuse(node.col_offset, what if isinstance(node, ast.Tuple) else other)

    def _number(self, node: ast.Constant) -> float:
        try:
            value = float(node.value)  # type: ignore[arg-type]
        except (TypeError, ValueError, OverflowError):
            value = math.inf
        if not math.isfinite(value):
            self._refuse(node.col_offset, "this number is too large")
        return value

    def _name(self, node: ast.Name) -> tuple[int, float]:
        if node.id in self.variables:
            return VARIABLES[node.id], 0.0
        if node.id in FUNCTIONS:
            self._refuse(node.col_offset, f"{node.id} is a function", f"Write {node.id}(...).")
        return NUMBER, {**CONSTANTS, **self.constants}[node.id]

    def _call(self, node: ast.Call, level: int) -> Iterator[tuple[int, float]]:
        if not isinstance(node.func, ast.Name) or node.func.id not in FUNCTIONS:
            hint = "A * may be missing in front of the bracket."
            self._refuse(node.col_offset, "this is no function", hint)
        name = node.func.id
        code, fewest, most = FUNCTIONS[name]
        n = len(node.args)
        if node.keywords or n < fewest or (most is not None and n > most):
            needed = f"{fewest}" if most == fewest else f"{fewest} or more"
            self._refuse(node.col_offset, f"{name} has {n} arguments; it takes {needed}")
        for k, argument in enumerate(node.args):
            yield from self._walk(argument, level + 1)
            if most is None and k > 0:
                yield code, 0.0
        if most is not None:
            yield code, 0.0


@written("number, or number with any unit")
def any_quantity(value: object, place: Place) -> Any:
    """The number in SI."""
    unit = "1"
    if isinstance(value, str) and (number := QUANTITY_NUMBER.match(value.strip())):
        unit = value.strip()[number.end() :].strip() or "1"
    return read_value(Quantity(unit), value, place)


def unit_name(unit: str) -> Plain:
    """How a unit is written of the dimension of an SI unit: how many of these it is."""

    @written(f"unit such as {unit}")
    def read(value: object, place: Place) -> float:
        text = Text().read(value, place)
        with place.told():
            return in_si(f"1 {text}", unit)

    return read


@dataclass(frozen=True, slots=True)
class FormulaTable(Table):
    """A table whose key ``expression`` is a formula of some variables."""

    variables: tuple[str, ...] = ("t",)

    def read(self, value: Any, place: Place) -> Values:
        """Its other values, and the instructions under "expression", times the unit."""
        found = Table.read(self, value, place)
        constants = found.pop("constants", {})
        for name in constants:
            if name in (*VARIABLES, *CONSTANTS, *FUNCTIONS) or not re.fullmatch(
                r"[A-Za-z_]\w*", name
            ):
                at = place.at("constants").at(name)
                raise at.error(f"{name!r} cannot be a constant.", "Take another name.")
        factor = found.pop("unit", 1.0)
        known = len(constants) == len(value.get("constants", {}))  # else they are told first
        if "expression" in found and known:
            at = place.at("expression")
            code = Reader(found["expression"], self.variables, constants, at).code()
            scaled = ((NUMBER, factor), (MUL, 0.0)) if factor != 1.0 else ()
            found["expression"] = (*code, *scaled)
        return found


def formula_keys(unit: str, variables: tuple[str, ...]) -> tuple[Key, ...]:
    """The keys of a formula whose values have this SI unit."""
    of = ", ".join(f"{name} ({VARIABLE_WORDS[name]})" for name in variables)
    return (
        Key("expression", Text(), f"A formula of {of}, in SI.", ...),
        Key("unit", unit_name(unit), "Unit of its values; the SI unit if missing."),
        Key("constants", Named(any_quantity, "constants"), "Numbers with names, in it by SI."),
    )


VARIABLE_WORDS = {"t": "time", "x": "coordinate or length", "v": "its rate"}


def formula_kind(unit: str, variables: tuple[str, ...], about: str, *more: Key) -> FormulaTable:
    """How a formula is written whose values have this SI unit."""
    return FormulaTable(about, (*formula_keys(unit, variables), *more), variables)
