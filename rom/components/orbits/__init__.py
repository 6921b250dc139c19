"""Motions of mechanisms that repeat, and equilibria past limit points, with their stability.

`flow` moves a mechanism through one period from many starts; `turns` looks at what advances by a
symmetric angle as if it had not; `shooting` compares both ends, `derivatives` says how they
change, with `beside` for small motions along the steps, and `search` closes the motion by Newton's
method. `motion` is the verb for one, `path` for a `family` of them. `repetition` refuses what
cannot repeat. `equilibria` are followed onto branches over the time at which drives and loads are
taken. `field` says where modules were.
"""
