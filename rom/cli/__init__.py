"""The command line: `verbs`, each of which loads what it needs when it runs.

`parser` is the grammar, of `options`, `matrices` and `described`; `main` runs one verb,
`answer` and `schemas` are what comes back, `speech` says it, `output` guards files that are there.
"""
