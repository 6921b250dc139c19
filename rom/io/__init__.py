"""Files: the native body file and other formats.

`native` is the file of a body, an `archive`, as is all that stands for `bodies`; `export` picks one
of `programs`, `sid`, `matrices`, `fields` or `fmu` by name, `history` writes motions. `files` are
written whole, by h5py beside dolfinx too, `ours` says which may be replaced and keeps a folder for
one run. Every writer raises ConfigError where the place is not writable, ResourceError where the
disk is full.
"""

from rom.lazy import front

front(__name__)
