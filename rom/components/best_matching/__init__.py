"""Best matching: what a motion is once rigid motion has been taken out, after Barbour and Bertotti.

Two snapshots of the same particles are laid over each other by the rigid motion that leaves the
smallest mass-weighted square of what differs. In velocities::

    2 T_bm = min over X of |v - R X|^2_M = v^T (M - M R (R^T M R)^-1 R^T M) v

with R the rigid motions of the configuration, and uniform growth where size has no meaning either.
The rest has no momentum and no angular momentum: the condition of Tisserand. A configuration laid
over a reference obeys that of Eckart; in a flexible body this is the mean-axis frame, and for small
deformations both are. The toys of N bodies, which are Newton's, show what remains of mechanics:
shapes, and a time read off them. Nothing here is about gravity as geometry. `projection` matches,
`bodies` are the toys and the shapes of three, `linking` the one system of which the motions of
Newton and of shapes are two gauges, `field` what the doctor compiles.

Source:
    After Mercati's chapter on shape dynamics, a theory of gravity of which this package takes the
    toys of N bodies alone; Barbour and Bertotti, Proc. R. Soc. A 382 (1982) 295;
    Barbour, Koslowski and Mercati, Phys. Rev. Lett. 113 (2014) 181101, for the point that divides
    the two arrows of time. Equations derived here.
"""

from rom.lazy import front

front(__name__)
