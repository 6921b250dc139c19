"""What is installed, what works, and what to type for the rest.

`machine` and `core`, the kind of processor, are looked at first, then `libraries`; `probes` are
processes that try what may crash, or compile ahead the cases of `first_use`.
"""
