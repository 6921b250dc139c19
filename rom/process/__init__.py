"""How this program runs as a process.

`launcher` tells ranks and threads, `mpirun` starts ranks, `interruption` makes signals exceptions,
`child` starts every other process by way of `child_entry`, `memory` says what may be taken,
`disk_watch` ends what waits for a full disk. By `patience` processes that would make the same file
take turns, and a user is told how long to wait; `progress` says how far work is, `stopwatch` where
its time goes; `seclusion` keeps libraries from the files of the working folder. Nothing is imported
here: the package comes by before the working folder is off the path of modules.
"""
