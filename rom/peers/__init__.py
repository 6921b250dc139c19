"""Other programs reduce the same matrices: for `rom bench peers`.

Each program runs in a process of its own, in an environment of its own that is made from the
package index when it is first needed. ``craig_bampton`` is the script it runs, without rom.
"""
