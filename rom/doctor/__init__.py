"""What is installed, what works, and what to type for the rest.

`core` knows the kind of processor, `libraries` machine, caches and packages; `probes` are
processes that try what may crash, or compile ahead the cases of `first_use`.
"""
