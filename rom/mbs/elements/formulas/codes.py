"""The instructions of a program: what each takes from the stack, and what it leaves there."""

NUMBER, T, X, V, PIECES = range(5)
ADD, SUB, MUL, DIV, POW, NEG = range(5, 11)
SIN, COS, TAN, ASIN, ACOS, ATAN, ATAN2 = range(11, 18)
EXP, LOG, SQRT, ABS, SIGN, MIN, MAX = range(18, 25)
SINH, COSH, TANH, STEP = range(25, 29)
NAMES = "sin cos tan asin acos atan atan2 exp log sqrt abs sign min max sinh cosh tanh step".split()
COUNTS: dict[str, tuple[int, int | None]] = {
    **dict.fromkeys(NAMES, (1, 1)),
    **{"atan2": (2, 2), "min": (2, None), "max": (2, None), "step": (3, 3)},
}
# name: instruction, fewest and most arguments; None for any number
FUNCTIONS = {name: (code, *COUNTS[name]) for code, name in enumerate(NAMES, start=SIN)}
VARIABLES = {"t": T, "x": X, "v": V}
OF_TWO = (ADD, SUB, MUL, DIV, POW, ATAN2, MIN, MAX)
# instruction: by how much the stack grows
STACK_GROWTH = {**dict.fromkeys((NUMBER, T, X, V), 1), **dict.fromkeys(OF_TWO, -1), STEP: -2}
MAX_STACK = 48  # values on the stack of a program
Code = tuple[tuple[int, float], ...]  # instructions with their numbers


def depth(code: Code) -> int:
    """Largest number of values on the stack."""
    now = most = 0
    for instruction, _ in code:
        now += STACK_GROWTH.get(instruction, 0)
        most = max(most, now)
    return most
