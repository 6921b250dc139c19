"""Linear user elements of Abaqus: reduced matrices as one element between labelled nodes.

``*USER ELEMENT, LINEAR`` lists the components of the first node, then lines ``place, components``
from which place on others hold; ``*MATRIX, TYPE=`` holds the upper triangle column by column. The
comment ``** ELEMENT NODES`` names the nodes. CalculiX writes the same for ``*SUBSTRUCTURE MATRIX
OUTPUT``, with a place of its own for each row.

CalculiX 2.20 writes the rows of the retained nodes as they are, without condensing what was left
out (its boundary columns are filled for frequency steps alone).

Source:
    Abaqus keywords guide, *USER ELEMENT and *MATRIX; CalculiX 2.20, writesubmatrix.f, mafillsm.f.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.sparse import csr_matrix, tril

from rom.decks.lines import row, whole
from rom.errors import ConfigError, UnsafeFileError, in_file
from rom.io.files import lines_of, need, number, write_lines
from rom.io.matrices.dmig import Dofs
from rom.model import Array
from rom.names import ORIGIN_MARK

MOST_NODES = 100_000
PER_LINE = 4
NODE_LIST = "ELEMENT NODES"


@dataclass(slots=True)
class _Element:
    """What was read of an element so far."""

    n_nodes: int = 0
    labels: list[int] = field(default_factory=list)
    lists: list[tuple[int, list[int]]] = field(default_factory=list)  # place, components from there
    values: dict[str, list[float]] = field(default_factory=dict)


def read_user_element(path: str | Path) -> dict[str, tuple[csr_matrix, Dofs]]:
    """{"STIFFNESS", "MASS", ...: (lower triangle (n, n), (n, 2) node and component)}.

    Raises:
        FileFormatError: naming the line, if the file is missing, damaged or has no such element.
        UnsafeFileError: if it claims more nodes than a dense matrix can have.
    """
    path = Path(path)
    element, keyword, kind = _Element(), "", ""
    hint = "Write the file again; it is cut or changed."
    with in_file(path), lines_of(path, "this is no user element", hint) as lines:
        for line in lines:
            if line.startswith("**"):
                keyword = _comment(element, keyword, line)
            elif line.startswith("*"):
                keyword, kind = _keyword(element, line)
            elif line.strip():
                _data(element, keyword, kind, line.replace(",", " ").split())
        return _matrices(element)


def write_user_element(
    matrices: Mapping[str, Array], dofs: Dofs, path: str | Path, *, nodes: dict[int, Array]
) -> Path:
    """Write symmetric matrices as an element U1 between its nodes.

    Args:
        matrices: {type, e.g. "STIFFNESS": (n, n)}, in units of any kind.
        dofs: (n, 2) label and component of each row, node by node; component 0 becomes 1.
        path: file to write.
        nodes: {label: (3,) position, in units of the matrices}; nodes without one, as those of
            modes, lie at the origin.
    """
    return write_lines(path, _document(matrices, np.asarray(dofs), nodes))


def _comment(element: _Element, keyword: str, line: str) -> str:
    """Labels stand in comments behind the one that announces them."""
    if NODE_LIST in line.upper():
        element.labels = []
        return NODE_LIST
    if keyword == NODE_LIST:
        element.labels += [whole(word) for word in re.findall(r"-?\d+", line)]
    return keyword


def _keyword(element: _Element, line: str) -> tuple[str, str]:
    words = [" ".join(word.split()).upper() for word in line.split(",")]
    options = dict(word.replace(" =", "=").replace("= ", "=").partition("=")[::2] for word in words)
    if words[0] == "*USER ELEMENT":
        need(not element.n_nodes, "there is a second one in the file")
        symmetric = "LINEAR" in options and "UNSYMM" not in options
        need(symmetric, "it is not linear and symmetric")
        element.n_nodes = whole(options.get("NODES", ""))
    kind = options.get("TYPE", "") if words[0] == "*MATRIX" else ""
    if words[0] == "*MATRIX":
        need(kind not in element.values, f"it has two matrices {kind!r}")
        element.values[kind] = []
    return words[0], kind


def _data(element: _Element, keyword: str, kind: str, words: list[str]) -> None:
    if keyword == "*MATRIX":
        element.values[kind] += map(number, words)
    elif keyword in ("*USER ELEMENT", NODE_LIST):
        numbers = [whole(word) for word in words]
        place, components = (numbers[0], numbers[1:]) if element.lists else (1, numbers)
        after = element.lists[-1][0] if element.lists else 0
        fits = after < place <= element.n_nodes and set(components) <= set(range(1, 7))
        need(fits, "places ascend up to NODES, and components are 1 to 6")
        element.lists.append((place, components))


def _matrices(element: _Element) -> dict[str, tuple[csr_matrix, Dofs]]:
    if element.n_nodes > MOST_NODES:
        raise UnsafeFileError(f"an element of {element.n_nodes} nodes is not read.")
    complete = element.n_nodes > 0 and element.lists and element.values
    need(complete, "there is no linear user element with matrices")
    dofs = _dofs(element)
    n = len(dofs)
    found = {}
    for kind, values in element.values.items():
        wanted = n * (n + 1) // 2
        what = f"{len(values)} numbers; the upper triangle of {n} rows has {wanted}"
        need(len(values) == wanted, f"the matrix {kind} has {what}")
        A = np.zeros((n, n))
        A[np.tril_indices(n)] = values  # rows of this triangle are columns of the other
        found[kind] = csr_matrix(A), dofs
    return found


def _dofs(element: _Element) -> Dofs:
    labels = element.labels or list(range(1, element.n_nodes + 1))
    fits = len(labels) == element.n_nodes
    need(fits, f"{len(labels)} nodes are named, but the element has {element.n_nodes}")
    ends = [place for place, _ in element.lists[1:]] + [element.n_nodes + 1]
    rows = [
        (labels[k - 1], component)
        for (place, components), end in zip(element.lists, ends, strict=True)
        for k in range(place, end)
        for component in components
    ]
    dofs = np.array(rows, dtype=np.int64).reshape(-1, 2)
    need(len(np.unique(dofs, axis=0)) == len(dofs), "a component of a node comes twice")
    return dofs


def _document(matrices: Mapping[str, Array], dofs: Dofs, nodes: dict[int, Array]) -> Iterator[str]:
    labels = list(dict.fromkeys(dofs[:, 0].tolist()))
    components = {label: dofs[dofs[:, 0] == label, 1].tolist() for label in labels}
    if [label for label in labels for _ in components[label]] != dofs[:, 0].tolist():
        raise ConfigError("the rows of a user element must be ordered node by node.")
    yield f"** {ORIGIN_MARK}"
    yield "*NODE"
    yield from (f"{k}, " + row(nodes.get(k, np.zeros(3))) for k in labels)
    yield f"*USER ELEMENT, TYPE=U1, NODES={len(labels)}, LINEAR"
    yield f"** {NODE_LIST}"
    yield from (f"** {line}" for line in _wrapped(labels))
    before: list[int] = []
    for place, node in enumerate(labels, 1):
        now = [max(component, 1) for component in components[node]]
        if now != before:
            yield ", ".join(map(str, now if place == 1 else [place, *now]))
        before = now
    for kind, A in matrices.items():
        yield f"*MATRIX, TYPE={kind}"
        values = tril(A).toarray()[np.tril_indices(len(dofs))]
        yield from map(row, np.split(values, range(PER_LINE, values.size, PER_LINE)))
    yield "*ELEMENT, TYPE=U1, ELSET=BODY"
    yield from _wrapped([1, *labels])
    yield "*UEL PROPERTY, ELSET=BODY"


def _wrapped(numbers: list[int]) -> Iterator[str]:
    lines = [numbers[k : k + PER_LINE] for k in range(0, len(numbers), PER_LINE)]
    for k, line in enumerate(lines):
        yield ", ".join(map(str, line)) + ("," if k + 1 < len(lines) else "")
