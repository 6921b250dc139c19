"""Other programs reduce the same matrices and move the same bodies: for `rom.bench`.

Each program runs in a process of its own, in an environment of its own that is made from the
package index when it is first needed. ``craig_bampton`` and ``ffrf`` are the scripts it runs,
without rom.
"""
