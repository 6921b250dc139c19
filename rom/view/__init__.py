"""Pictures and films, drawn off-screen in a process that never loads dolfinx.

`figures` are curves and plane fields, `scenes` bodies in space, `canvas` what both are drawn on.
"""

from rom.lazy import front

front(__name__)
