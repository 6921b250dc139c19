"""Which bodies touch each other, where their blocks are stored, and how they are eliminated.

Bodies and groups of constraint rows are the nodes of a graph; joints and forces are its edges. An
elimination plan removes one node after the other, leaf to root, so that the work and the memory of
a chain or tree grow with its length only. `rom.mbs.equations.graph` makes both tables, once for a
mechanism.
"""

from rom.mbs.kernels.tables import Index1, Index2, Table, table


@table
class Plan(Table):
    """Elimination of k nodes, each coupled to later nodes with c unknowns together.

    The factor is one vector. Of each node it holds the pivot (d, d), the block to its right
    (d, c) and the block below (c, d), all by rows.

    Attributes:
        position: (n + m,) place of each velocity and multiplier in the order of elimination.
        size, wide: (k,) numbers d and c of each node; start: (k,) its first place.
        pivot, right, below: (k,) where its blocks begin in the factor.
        next_first: (k + 1,), next: later nodes coupled to each node; shift: their first columns.
        pair_first: (k,), target, stride: where a product of two of them is subtracted, and the
            distance of its rows.
        block_to, block_stride: (e,) the same for the blocks of two bodies.
        corner: (m,) where the entry of a multiplier by itself stands.
        row_to, row_back, row_stride: (m, 4) where the gradient of a constraint row goes, as a row
            and as a column, and the distance of the entries of the column.
        memory: (1,) length of the factor.
    """

    position: Index1
    size: Index1
    wide: Index1
    start: Index1
    pivot: Index1
    right: Index1
    below: Index1
    next_first: Index1
    next: Index1
    shift: Index1
    pair_first: Index1
    target: Index1
    stride: Index1
    block_to: Index1
    block_stride: Index1
    corner: Index1
    row_to: Index2
    row_back: Index2
    row_stride: Index2
    memory: Index1


@table
class Graph(Table):
    """Where the entries of two bodies, or of a row and a body, are stored.

    Attributes:
        compact: 1 if only blocks are stored and eliminated by the plan, 0 for whole matrices.
        shares: 1 if constraints in blocks may repeat others: each of them gives way a little.
        first: (b + 1,), other: (e,) bodies that each body is coupled to, itself included,
            ascending; x, y: (e,) first row and column of their block in Work.S and Work.Kt.
        own: (b,) block of each body with itself.
        body: (m, 4) different bodies that a constraint row moves, -1 for none; at: (m, 4) their
            first column in Work.G.
        joint_first: (p + 1,), joint_rows: (m,) constraint rows of each joint.
        plan: of the elimination; empty for whole matrices.
    """

    compact: int
    shares: int
    first: Index1
    other: Index1
    x: Index1
    y: Index1
    own: Index1
    body: Index2
    at: Index2
    joint_first: Index1
    joint_rows: Index1
    plan: Plan
