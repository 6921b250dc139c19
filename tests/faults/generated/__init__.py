"""Faults generated from tables, each a line in a `cases_*.py`.

What is done is a command line behind ``rom`` or a function of the folder it runs in, a fresh copy
of the stock of valid files in `stock.py`; what may come of it stands beside it.
"""
