"""Runs in hundreds: samples of parameters, measured on many processes, kept one by one.

`samples` makes tables of parameters, `running` hands them to executors, `worker` measures them
there, `journal` keeps what came back, and `study` is the call and what it answers. `fit` seeks
parameters from many starts, as a study; `fitted` is what measured histories say about them.
"""

from rom.lazy import front

front(__name__)
