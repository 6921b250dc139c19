"""The instructions of a program: what each takes from the stack, and what it leaves there."""

NUMBER, T, X, V, PIECES = range(5)
ADD, SUB, MUL, DIV, POW, NEG = range(5, 11)
SIN, COS, TAN, ASIN, ACOS, ATAN, ATAN2 = range(11, 18)
EXP, LOG, SQRT, ABS, SIGN, MIN, MAX = range(18, 25)
SINH, COSH, TANH, STEP = range(25, 29)
FUNCTIONS = {  # name: instruction, fewest and most arguments; None for any number
    "sin": (SIN, 1, 1),
    "cos": (COS, 1, 1),
    "tan": (TAN, 1, 1),
    "asin": (ASIN, 1, 1),
    "acos": (ACOS, 1, 1),
    "atan": (ATAN, 1, 1),
    "atan2": (ATAN2, 2, 2),
    "exp": (EXP, 1, 1),
    "log": (LOG, 1, 1),
    "sqrt": (SQRT, 1, 1),
    "abs": (ABS, 1, 1),
    "sign": (SIGN, 1, 1),
    "min": (MIN, 2, None),
    "max": (MAX, 2, None),
    "sinh": (SINH, 1, 1),
    "cosh": (COSH, 1, 1),
    "tanh": (TANH, 1, 1),
    "step": (STEP, 3, 3),
}
VARIABLES = {"t": T, "x": X, "v": V}
# instruction: by how much the stack grows
STACK_GROWTH = {
    **dict.fromkeys((NUMBER, T, X, V), 1),
    **dict.fromkeys((ADD, SUB, MUL, DIV, POW, ATAN2, MIN, MAX), -1),
    STEP: -2,
}
MAX_STACK = 48  # values on the stack of a program
Code = tuple[tuple[int, float], ...]  # instructions with their numbers


def depth(code: Code) -> int:
    """Largest number of values on the stack."""
    now = most = 0
    for instruction, _ in code:
        now += STACK_GROWTH.get(instruction, 0)
        most = max(most, now)
    return most
