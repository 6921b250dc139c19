"""Eigenvalue problems, written on verbs of operators.

`verbs` are what reductions need of K and M, `scipy` does them with SciPy on one process,
`condensed` solves in every support with one factor, `completeness` says how surely no mode was
missed, `attachments` adds masses and springs at nodes, `supports` says what is held.
"""

from rom.lazy import front

front(__name__)
