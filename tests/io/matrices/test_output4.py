"""OUTPUT4 files of every kind that programs write, read to the bit.

The writer here follows the published description of the format (MSC Nastran DMAP Programmer's
Guide, OUTPUT4), independently of the reader: dense columns, strings with short and with long
heads (BIGMAT), types 1 to 4, text in several formats, binary of both byte orders, and words of
eight bytes.
"""

import itertools
import struct

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from cases.files.damage import changed
from cases.refusals import refuses
from rom.errors import ConfigError, FileFormatError, UnsafeFileError
from rom.io import read_matrix, read_op4
from rom.io.matrices.op4 import write_op4

LAYOUTS = ("dense", "short", "long")
KINDS = (1, 2, 3, 4)  # real and complex, each of single and double precision
FORMATS = ("1P,5E16.9", "3D23.16", "1P,3E23.16", "(1P,2E26.17E3)", "")
BINARY = tuple(itertools.product("<>", (4, 8)))


def sample(kind, rows=7, columns=5):
    """Columns with gaps, one of zeros, numbers of many sizes and both signs."""
    rng = np.random.default_rng(kind)
    A = rng.normal(size=(rows, columns)) * 10.0 ** rng.integers(-30, 30, (rows, columns))
    if kind > 2:
        A = A + 1j * rng.normal(size=A.shape)
    A[[1, 2, 5], 1] = A[:, 3] = A[0, 4] = 0.0
    return A.astype({1: "f4", 2: "f8", 3: "c8", 4: "c16"}[kind])


def strings(column):
    filled = np.flatnonzero(column)
    runs = np.split(filled, np.flatnonzero(np.diff(filled) > 1) + 1) if filled.size else []
    return [(run[0] + 1, column[run]) for run in runs]


def columns_of(A, layout):
    for c, column in enumerate(A.T, 1):
        runs = strings(column)
        if layout == "dense" and runs:
            first, last = runs[0][0] - 1, runs[-1][0] - 1 + runs[-1][1].size
            runs = [(first + 1, column[first:last])]
        if runs:
            yield c, runs


def reals(values):
    values = np.ascontiguousarray(values)
    return values.view(values.real.dtype) if np.iscomplexobj(values) else values


def text_of(A, name, layout, kind, form, *, bare=False, wide=False):
    rows, columns = A.shape[0] * (-1 if layout == "long" else 1), A.shape[1]
    shape = f"{columns:16d}{rows:16d}" if wide else f"{columns:8d}{rows:8d}"
    out = [f"{shape}{2:8d}{kind:8d}{name:<8}{form}" + "|I16" * wide]
    per_line, digits, width, letter = {"1P,5E16.9": (5, 9, 16, "E"), "3D23.16": (3, 16, 23, "D"),
        "1P,3E23.16": (3, 16, 23, "E"), "(1P,2E26.17E3)": (2, 17, 26, "E"),
        "": (5, 9, 16, "E")}[form]  # fmt: skip

    def numbers(values):
        for k in range(0, values.size, per_line):
            cells = (f"{float(x):{width}.{digits}E}" for x in values[k : k + per_line])
            yield "".join(c.replace("E", " " if bare else letter) for c in cells)

    words_each = 2 if kind in (2, 4) else 1
    for c, runs in columns_of(A, layout):
        if layout == "dense":
            first, values = runs[0]
            out += [f"{c:8d}{first:8d}{reals(values).size:8d}", *numbers(reals(values))]
            continue
        head, body = (2 if layout == "long" else 1), []
        total = sum(reals(v).size * words_each + head for _, v in runs)
        for first, values in runs:
            words = reals(values).size * words_each + 1
            body.append(f"{words:8d}{first:8d}" if head == 2 else f"{65536 * words + first:12d}")
            body += numbers(reals(values))
        out += [f"{c:8d}{0:8d}{total:8d}", *body]
    return "\n".join([*out, f"{columns + 1:8d}{1:8d}{1:8d}", *numbers(np.ones(1))]) + "\n"


def binary_of(A, name, layout, kind, order, size):
    whole = order + {4: "i", 8: "q"}[size]
    real = f"{order}f{max(size, 8 if kind in (2, 4) else 4)}"

    def integers(*values):
        return b"".join(struct.pack(whole, v) for v in values)

    def record(data):
        mark = struct.pack(f"{order}i", len(data))
        return mark + data + mark

    rows, columns = A.shape[0] * (-1 if layout == "long" else 1), A.shape[1]
    head = name.encode().ljust(8)
    if size == 8:  # four letters to a word
        head = head[:4].ljust(8) + head[4:].ljust(8)
    out = record(integers(columns, rows, 2, kind) + head)
    for c, runs in columns_of(A, layout):
        found = [(first, reals(v).astype(real).tobytes()) for first, v in runs]
        if layout == "dense":
            first, data = found[0]
            out += record(integers(c, first, len(data) // size) + data)
            continue
        body = b""
        for first, data in found:
            words = len(data) // size + 1
            body += integers(words, first) if layout == "long" else integers(65536 * words + first)
            body += data
        out += record(integers(c, 0, len(body) // size) + body)
    last = np.sqrt(np.array([2.0])).astype(real).tobytes()
    return out + record(integers(columns + 1, 1, len(last) // size) + last)


@pytest.mark.parametrize("form", FORMATS)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_text_of_all_types_in_one_file_is_read_to_the_bit(form, layout, tmp_path):
    """Real and complex, single and double stand in one file; decimals are read as Python does."""
    path = tmp_path / "a.op4"
    path.write_text("".join(text_of(sample(k), f"A{k}", layout, k, form) for k in KINDS))
    found = read_op4(path)
    digits = 9 if "16.9" in form or not form else 17
    for kind in KINDS:
        A = sample(kind)
        parts = [[float(f"{float(x):.{digits}E}") for x in reals(row)] for row in A]
        expected = np.array(parts) if digits == 9 else reals(A).astype(float).reshape(7, -1)
        assert_array_equal(reals(found[f"A{kind}"].toarray()).reshape(7, -1), expected)


@pytest.mark.parametrize(("order", "size"), BINARY)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_binary_of_all_types_in_one_file_is_read_to_the_bit(layout, order, size, tmp_path):
    path = tmp_path / "a.op4"
    each = [binary_of(sample(k), f"MAT{k}LONG", layout, k, order, size) for k in KINDS]
    path.write_bytes(b"".join(each))
    found = read_op4(path)
    assert list(found) == [f"MAT{k}LONG" for k in KINDS]
    for kind in KINDS:
        assert_array_equal(found[f"MAT{kind}LONG"].toarray(), sample(kind))


@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize("sign", [1, -1])
def test_headers_of_wide_numbers_and_negative_counts(wide, sign, tmp_path):
    """BIGMAT has a negative number of rows; some programs give that of columns a sign, too."""
    text = text_of(sample(2), "A", "long", 2, "1P,3E23.16", wide=wide)
    if sign < 0:
        n = 16 if wide else 8
        text = f"{-5:{n}d}" + text[n:]
    (tmp_path / "a.op4").write_text(text)
    assert_array_equal(read_op4(tmp_path / "a.op4")["A"].toarray(), sample(2))


def test_our_writer_is_that_here_and_exponents_of_three_digits_have_no_letter(tmp_path):
    """Fortran leaves the letter out where E23.16 has no place for it."""
    path = write_op4({"A": sample(2)}, tmp_path / "d.op4")
    assert path.read_text() == text_of(sample(2), "A", "dense", 2, "1P,3E23.16")
    text = text_of(np.array([[1.5e-9]]), "A", "dense", 2, "3D23.16").replace("D-09", "-209", 1)
    (tmp_path / "a.op4").write_text(text)
    assert read_op4(tmp_path / "a.op4")["A"].toarray() == [[1.5e-209]]


def test_real_matrices_are_used_beside_complex_ones(tmp_path):
    square = np.array([[2.0, -1.0], [-1.0, 2.0]])
    path = tmp_path / "b.op4"
    both = text_of(square * (1 + 2j), "CC", "dense", 4, ""), text_of(square, "KAA", "dense", 2, "")
    path.write_text("".join(both))
    assert_array_equal(read_matrix((path, "kaa")).A.toarray(), square)
    assert_array_equal(read_op4(path)["CC"].toarray(), square * (1 + 2j))
    with pytest.raises(FileFormatError, match="the matrix CC is complex") as caught:
        read_matrix((path, "CC"))
    assert "KAA" in caught.value.hint
    two = r"CC \(2 x 2 complex, line 1\), KAA \(2 x 2, line \d+\)"
    refuses(ConfigError, two, read_matrix, path)


@pytest.mark.parametrize("binary", [False, True])
def test_of_two_matrices_of_a_name_one_is_chosen(binary, tmp_path):
    """The later one alone would be taken without a word, where an assembly has two of them."""
    small, large = np.array([[2.0]]), np.diag([3.0, 4.0])
    path = tmp_path / "c.op4"
    if binary:
        each = [binary_of(A, "KAA", "dense", 2, "<", 4) for A in (small, large)]
        path.write_bytes(b"".join(each))
        places = f"byte 0.*byte {len(each[0])}"
    else:
        path.write_text("".join(text_of(A, "KAA", "dense", 2, "") for A in (small, large)))
        places = r"1 x 1, line 1\), .*2 x 2, line 6\)"
    said = f"2 matrices 'KAA'.*KAA#1.*{places}"
    refuses(ConfigError, said, read_op4(path).__getitem__, "KAA")
    refuses(ConfigError, said, read_matrix, (path, "kaa"))
    assert_array_equal(read_matrix((path, "kaa#2")).A.toarray(), large)
    assert_array_equal(read_op4(path)["KAA#1"].toarray(), small)


SIZE = f"{5:8d}{7:8d}"
test_what_is_no_matrix_is_named_with_its_line = changed(
    text_of(sample(2), "A", "dense", 2, "3D23.16"),
    "e.op4",
    read_op4,
    (f"{2:8d}{2:8d}A", f"{2:8d}{5:8d}A", r"line \d+: .*unknown type 5"),
    ("3D23.16", "3Z23.16", r"line \d+: .*format '3Z23.16' is unknown"),
    # before memory is taken
    (SIZE, f"{99999999:8d}{7:8d}", UnsafeFileError, "7 rows and 99999999 columns"),
    (f"{1:8d}{1:8d}{7:8d}", f"{1:8d}{1:8d}{9999997:8d}", "line 2: .*9999997 values"),
    (SIZE, f"{0:8d}{7:8d}", r"line \d+: .*7 rows and 0 columns"),
    (SIZE, f"{5:8d}{4:8d}", r"line \d+: .*reaches beyond 4 rows"),
)
