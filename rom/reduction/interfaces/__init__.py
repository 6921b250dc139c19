"""Interfaces of reduced bodies.

`kinds` tie nodes to few coordinates, `polynomial`, `snapshots` and `characteristic` give them
shapes, `order` finds how many; `connection` is what a basis sees.
"""
