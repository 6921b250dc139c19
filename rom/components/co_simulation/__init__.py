"""Units of other programs (FMI 2 and 3) that set motors and loads of a mechanism.

`units` connects them, `running` runs each in a process of its own.
"""
