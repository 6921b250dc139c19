"""What is installed, what works, and what to type for the rest.

`examination` is all of it in order, a `finding` one line of it: `machine` and `core`, `libraries`,
`pictures`, `caches`. `probes` are processes that try what may crash, one of them `drawing`.
"""
