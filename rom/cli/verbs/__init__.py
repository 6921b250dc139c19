"""The verbs of the command line, one module each.

`mesh`, `modes` and `reduce` go from a geometry to a body, `check`, `export`, `report` and `view`
look at it, `simulate` moves it, `swing` does all in one go; `bench`, `doctor` and `completion` are
about the program. Fields bring verbs of their own.
"""
