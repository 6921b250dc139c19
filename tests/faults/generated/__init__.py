"""Faults generated from tables.

A case is one line in a `cases_*.py`: a name, what is done, what may come of it, and the words that
name the culprit. What is done is a command line behind ``rom``, or a function of the folder it runs
in; the folder is a fresh copy of the stock of valid files in `stock.py`.
"""
