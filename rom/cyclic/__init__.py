"""Wheels of equal sectors.

`sector` and `faces` describe one, `modes` and `reduced` solve it; `rotation`, `gyroscopic`,
`travelling` and `campbell` let it turn, `supports` hold it; `blades` lets blades differ.
"""
