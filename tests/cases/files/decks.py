"""Files of other programs, written by hand."""

import numpy as np

BY_HAND = """*HEADING
two nodes that move and turn in a plane, two of them along x only
*USER ELEMENT, TYPE=U7, NODES=4, LINEAR
** ELEMENT NODES
** 9, 4,
** 30, 31
1, 2, 6
3, 1
*Matrix, type=Stiffness
1., 2., 3., 4.
5., 6., 7., 8.D0
9., 10., 11., 12.
13., 14., 15., 16.
17., 18., 19., 20.
21., 22., 23., 24.
25., 26., 27., 28.
29., 30., 31., 32.
33., 34., 35., 36.
*ELEMENT, TYPE=U7
1, 9, 4, 30, 31
"""

DECK = """*HEADING
*NODE, NSET=Left
3, 0., 0., 0.1
7, 0., 0., 0.
*NODE
20, 0., 0.2, 0.1
12, 0., 0.2, 0.
55, 0.3, 0., 0.1
101, 0.3, 0., 0.
60, 0.3, 0.2, 0.1
41, 0.3, 0.2, 0.
*NSET, NSET=upper, GENERATE
12, 20, 8
*NSET, nset=root
left, upper,
*NSET, NSET=tip
41, 55, 60
101
*ELSET, ELSET=tip
1, 2
"""


def header(kind, n, spacing, *, response=(7, 3), reference=(11, -3), numerator=12, entities=None):
    """Records 1 to 11 of a dataset 58, written by the columns of the format."""
    low, step = (2.0, 0.5) if spacing else (0.0, 0.0)
    own = entities or ("NONE", "NONE")
    lines = ["wing tip", "run 3", "12-MAY-26", "NONE", "NONE"]
    lines += [
        f"{4:5d}{1:10d}{0:5d}{0:10d} {own[0]:<10}{response[0]:10d}{response[1]:4d}"
        f" {own[1]:<10}{reference[0]:10d}{reference[1]:4d}",
        f"{kind:10d}{n:10d}{spacing:10d}{low:13.5e}{step:13.5e}{0:13.5e}",
    ]
    for what in (18, numerator, 13, 0):
        lines.append(f"{what:10d}{0:5d}{0:5d}{0:5d} {'NONE':<20} {'NONE':<20}")
    return "\n".join(lines) + "\n"


def text(numbers, widths):
    """Numbers in columns; those of width 13 have five decimals, those of 20 twelve."""
    out = ""
    for i, number in enumerate(numbers):
        width = widths[i % len(widths)]
        out += f"{number:{width}.{5 if width == 13 else 12}E}"
        if (i + 1) % len(widths) == 0:
            out += "\n"
    return out.rstrip("\n") + "\n"


def dataset(kind, spacing, values, **options):
    """A whole text dataset; kind 2 and 5 single, 4 and 6 double; 5 and 6 complex."""
    n = len(values[0])
    numbers = np.column_stack(values).ravel()
    widths = [13] * 6
    if kind in (4, 6):
        widths = [20] * 4 if spacing else ([13, 20] * 2 if kind == 4 else [13, 20, 20])
    body = header(kind, n, spacing, **options) + text(numbers, widths)
    return f"{-1:6d}\n{58:6d}\n{body}{-1:6d}\n"


X = np.array([2.0, 2.5, 3.0, 3.5, 4.0])
RE, IM = np.array([1.5, -2.25, 3e-7, 4.0, -5e6]), np.array([-1.0, 0.5, 2e-3, -7e-9, 8.0])


def binary(kind, order):
    """A whole binary dataset of complex values; kind 5 single, 6 double, order 1 little-endian."""
    numbers = np.column_stack([RE, IM]).astype(f"{'<>'[order - 1]}f{4 * (kind - 4)}").tobytes()
    head = f"    58b{order:6d}{2:6d}{11:12d}{len(numbers):12d}" + " 0 0 0 0"
    return f"{-1:6d}\n{head}\n{header(kind, 5, 1)}".encode() + numbers + b"\n    -1\n"
