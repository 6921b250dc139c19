"""How this program runs as a process.

`launcher` tells ranks and threads, `interruption` makes signals exceptions, `child` starts every
other process by way of `child_entry`, `memory` says what may be taken. Nothing is imported here:
the package comes by before the working folder is off the path of modules.
"""
