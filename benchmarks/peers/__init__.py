"""Other programs reduce the same matrices and move the same bodies: for ``rom bench``.

Each program runs in a process of its own, in an environment of its own that is made from the
package index when it is first needed. `craig_bampton`, `ffrf`, `beams`, `cantilever` and
`ross_films` are the scripts it runs, without rom; `compare`, `motion`, `rods`, `spin_up` and
`films` start them and compare, `ours` is the same reduction by rom, `mechanisms` plain data for
both, `reference` paths that are kept, `machine` what two processes of this machine can gain at all.
"""
