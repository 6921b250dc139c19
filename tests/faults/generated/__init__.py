"""Faults from tables, each a line in a `cases_*.py`: what is done, and what may come of it.

It is done in a fresh copy of the folder of valid files in `stock.py`.
"""
