"""The compiler of kernels, beyond what Numba does by itself.

`intermediate` leaves functions that only kernels call as they are written until a kernel takes
them in; `cache` keeps compiled code, and lets one of several processes make it.
"""
