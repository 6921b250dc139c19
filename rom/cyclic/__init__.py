"""Wheels of equal sectors.

`sector` and `faces` describe one, `modes` and `reduced` solve it; `rotation`, `gyroscopic`,
`travelling` and `campbell` let it turn, `supports` hold it; `blades` lets blades differ;
`certificate` shows what a reduction lost.
"""

from rom.lazy import front

front(__name__)
