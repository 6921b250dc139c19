"""Programs on values with their first and second derivative along one direction.

A value is a triple (a, a', a''); functions of it follow the chain rule
f(a) = (f, f_1 a', f_2 a'^2 + f_1 a''). A constant, whose derivatives are zero, stays one also where
f_1 is infinite: sqrt(0) is 0.
"""

import math

from rom.mbs.elements.formulas import codes
from rom.mbs.kernels.algebra import add, row, sub
from rom.mbs.kernels.compiled import inner


@inner
def chained(f, f1, f2, a):
    """A function of a with its derivatives there."""
    if a[1] == 0.0 and a[2] == 0.0:
        return f, 0.0, 0.0
    return f, f1 * a[1], f2 * a[1] * a[1] + f1 * a[2]


@inner
def product(a, b):
    """The product a b."""
    return (a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2])


@inner
def quotient(a, b):
    """The quotient a / b."""
    f = a[0] / b[0]
    first = (a[1] - f * b[1]) / b[0]
    return f, first, (a[2] - 2.0 * first * b[1] - f * b[2]) / b[0]


@inner
def power(a, b):
    """The power a^b; of a negative number only where b is constant and whole."""
    f, n = a[0] ** b[0], b[0]
    if b[1] == 0.0 and b[2] == 0.0:
        f1 = n * a[0] ** (n - 1.0) if n != 0.0 else 0.0
        f2 = n * (n - 1.0) * a[0] ** (n - 2.0) if n != 0.0 and n != 1.0 else 0.0
        return chained(f, f1, f2, a)
    if a[0] <= 0.0:
        return f, math.nan, math.nan
    logarithm = chained(math.log(a[0]), 1.0 / a[0], -1.0 / a[0] ** 2, a)
    return chained(f, f, f, product(b, logarithm))


@inner
def angle(y, x):
    """The angle atan2(y, x)."""
    f = math.atan2(y[0], x[0])
    if y[1] == 0.0 and y[2] == 0.0 and x[1] == 0.0 and x[2] == 0.0:
        return f, 0.0, 0.0
    square = x[0] * x[0] + y[0] * y[0]
    growth = 2.0 * (x[0] * x[1] + y[0] * y[1])
    first = (x[0] * y[1] - y[0] * x[1]) / square
    return f, first, (x[0] * y[2] - y[0] * x[2] - first * growth) / square


@inner
def smooth_step(a, start, end):
    """0 before the start, 1 behind the end, 10 s^3 - 15 s^4 + 6 s^5 in between."""
    s = quotient(sub(a, start), sub(end, start))
    u = s[0]
    if u <= 0.0:
        return 0.0, 0.0, 0.0
    if u >= 1.0:
        return 1.0, 0.0, 0.0
    f = u * u * u * (10.0 + u * (6.0 * u - 15.0))
    return chained(f, 30.0 * (u * (1.0 - u)) ** 2, 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u), s)


@inner
def pieces(program, at, a):
    """Piecewise polynomials, whose first and last one reach on for ever.

    From ``at`` on stand: their number n, coefficients of each k, the n - 1 knots between them, and
    (n, k + 1) rows: a centre and the coefficients about it, highest first.
    """
    n, k = int(program[at]), int(program[at + 1])
    low, high = 0, n - 1
    while low < high:
        middle = (low + high) // 2
        if a[0] >= program[at + 2 + middle]:
            low = middle + 1
        else:
            high = middle
    row = at + 1 + n + low * (k + 1)
    h, f, f1, f2 = a[0] - program[row], 0.0, 0.0, 0.0
    for c in range(1, k + 1):
        f2 = f2 * h + 2.0 * f1
        f1 = f1 * h + f
        f = f * h + program[row + c]
    return chained(f, f1, f2, a)


@inner
def circular(code, a):
    """Sine, cosine, tangent, and their inverses."""
    x = a[0]
    if code == codes.SIN:
        s, c = math.sin(x), math.cos(x)
        return chained(s, c, -s, a)
    if code == codes.COS:
        s, c = math.sin(x), math.cos(x)
        return chained(c, -s, -c, a)
    if code == codes.TAN:
        f = math.tan(x)
        return chained(f, 1.0 + f * f, 2.0 * f * (1.0 + f * f), a)
    if code == codes.ATAN:
        slope = 1.0 / (1.0 + x * x)
        return chained(math.atan(x), slope, -2.0 * x * slope * slope, a)
    if not -1.0 <= x <= 1.0:
        return math.nan, math.nan, math.nan
    slope = 1.0 / math.sqrt(1.0 - x * x)
    if code == codes.ASIN:
        return chained(math.asin(x), slope, x * slope**3, a)
    return chained(math.acos(x), -slope, -x * slope**3, a)


@inner
def hyperbolic(code, a):
    """Hyperbolic sine, cosine and tangent, exponential, logarithm and square root."""
    x = a[0]
    if code == codes.EXP:
        f = math.exp(x)
        return chained(f, f, f, a)
    if code == codes.LOG:
        if x < 0.0:
            return math.nan, math.nan, math.nan
        return chained(math.log(x), 1.0 / x, -1.0 / (x * x), a)
    if code == codes.SQRT:
        f = math.sqrt(x) if x >= 0.0 else math.nan
        return chained(f, 0.5 / f, -0.25 / (f * f * f), a)
    if code == codes.TANH:
        f = math.tanh(x)
        return chained(f, 1.0 - f * f, -2.0 * f * (1.0 - f * f), a)
    s, c = math.sinh(x), math.cosh(x)
    return chained(s, c, s, a) if code == codes.SINH else chained(c, s, c, a)


@inner
def of_one(code, a):
    """A function of one number."""
    if code == codes.NEG:
        return -a[0], -a[1], -a[2]
    if code == codes.ABS:
        if a[0] == 0.0:
            return chained(0.0, 0.0, 0.0, a)
        return (-a[0], -a[1], -a[2]) if a[0] < 0.0 else a
    if code == codes.SIGN:
        return math.copysign(1.0, a[0]) if a[0] != 0.0 else 0.0 * a[0], 0.0, 0.0
    if code in (codes.SIN, codes.COS, codes.TAN, codes.ASIN, codes.ACOS, codes.ATAN):
        return circular(code, a)
    return hyperbolic(code, a)


@inner
def of_two(code, a, b):
    """A function of two numbers."""
    if code == codes.ADD:
        return add(a, b)
    if code == codes.SUB:
        return sub(a, b)
    if code == codes.MUL:
        return product(a, b)
    if code == codes.DIV:
        return quotient(a, b)
    if code == codes.POW:
        return power(a, b)
    if code == codes.ATAN2:
        return angle(a, b)
    if a[0] != a[0] or (a[0] <= b[0]) == (code == codes.MIN):  # what is no number wins
        return a
    return b


@inner
def run(program, t, x, v, stack):
    """Value and derivatives of a program of variables t, x, v with theirs; stack (MAX_STACK, 3).

    The program has the number of instructions, (instruction, number) of each, and tables behind.
    """
    top = -1
    for k in range(int(program[0])):
        code, number = int(program[1 + 2 * k]), program[2 + 2 * k]
        if code <= codes.V:
            top += 1
            a = (number, 0.0, 0.0)
            if code != codes.NUMBER:
                a = t if code == codes.T else x if code == codes.X else v
        elif code in codes.OF_TWO:
            top -= 1
            a = of_two(code, row(stack, top, 0), row(stack, top + 1, 0))
        elif code == codes.STEP:
            top -= 2
            a = smooth_step(row(stack, top, 0), row(stack, top + 1, 0), row(stack, top + 2, 0))
        elif code == codes.PIECES:
            a = pieces(program, int(number), row(stack, top, 0))
        else:
            a = of_one(code, row(stack, top, 0))
        stack[top, 0], stack[top, 1], stack[top, 2] = a
    return row(stack, 0, 0)
