"""Motions of mechanisms that repeat, and equilibria past limit points, with their stability.

`flow` moves a mechanism through one period from many starts, with small motions along the steps;
`shooting` compares both ends, what advances by a symmetric angle turned back, `derivatives` say how
they change. `motion` closes one by Newton's method, `path` follows a `family` of them. `repetition`
refuses what cannot repeat. `equilibria` are followed onto branches over the time at which drives
and loads are taken. `field` says where modules were.
"""
