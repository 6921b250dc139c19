"""Eigenvalue problems, written on verbs of operators.

`verbs` are what reductions need of K and M, `scipy` does them with SciPy on one process,
`condensed` solves in every support with one factor, `held` bodies are factored once and say what
moves, `completeness` begins searches at random and says how surely no mode was missed, `lanczos`
spans blocks, `search` goes on until a count agrees, `band` finds all modes up to a frequency,
`attachments` adds masses and springs at nodes, `supports` says what is held, `connection` has a
model in interface coordinates, `workers` who solves with matrices that are whole in a process.
"""

from rom.lazy import front

front(__name__)
