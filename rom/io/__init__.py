"""Files: the native body file and other formats.

`native` is the file of a body, an `archive`, as is all that stands for `bodies`; `export` picks one
of `programs`, `sid`, `matrices`, `fields` or `fmu` by name, `history` writes motions. `files` are
written whole, `ours` says which may be replaced and keeps a folder for one run, `hdf5` loads h5py
beside dolfinx.
"""

from rom.lazy import front

front(__name__)
