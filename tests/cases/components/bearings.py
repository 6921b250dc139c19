"""Published numbers of journal bearings, and bearings like theirs."""

import numpy as np

from rom.components.journal_bearing import Groove, JournalBearing

RUN = {"speed": 100.0, "viscosity": 0.03}
SIDES = [Groove(np.radians(a), np.radians(20)) for a in (90, -90)]


def bearing(slender=1.0, grooves=(), cells=(180, 10), aligned=True, **more):
    """100 mm thick, 0.1 mm of clearance, length over diameter as given."""
    return JournalBearing(0.1, 0.1 * slender, 1e-4, grooves, cells=cells, aligned=aligned, **more)


def load(b, sommerfeld):
    """Load along X at which a bearing has that Sommerfeld number."""
    unit = RUN["viscosity"] * RUN["speed"] * b.radius * b.length * (b.radius / b.clearance) ** 2
    return np.array([unit / (np.pi * sommerfeld), 0.0])


def numbers(line):
    return [float(word) for word in line.split()]


# Raimondi and Boyd (1958), film from the largest gap: L/D, eccentricity, S, attitude [deg],
# (R/c) f, Q / (R c N L), share of Q that leaves at the sides, mean over largest pressure. The S
# printed at 1, 0.4 is 1.4 % off; the last pressures are those of coarse grids.
RAIMONDI_BOYD = [numbers(line) for line in """
1 .1 1.33 79.5 26.4 3.37 .150 .540
1 .2 .631 74.02 12.8 3.59 .280 .529
1 .4 .264 63.10 5.79 3.99 .497 .484
1 .6 .121 50.58 3.22 4.33 .680 .415
1 .8 .0446 36.24 1.70 4.62 .842 .313
1 .9 .0188 26.45 1.05 4.74 .919 .247
1 .97 .00474 15.47 .514 4.82 .973 .152
.5 .1 4.31 81.62 85.6 3.43 .173 .523
.5 .2 2.03 74.94 40.9 3.72 .318 .506
.5 .4 .779 61.45 17.0 4.29 .552 .441
.5 .6 .319 48.14 8.10 4.85 .730 .365
.5 .8 .0923 33.31 3.26 5.41 .874 .267
.5 .9 .0313 23.66 1.60 5.69 .939 .206
.5 .97 .00609 13.75 .610 5.88 .980 .126
.25 .1 16.2 82.31 322 3.45 .180 .515
.25 .2 7.57 75.18 153 3.76 .330 .489
.25 .4 2.83 60.86 61.1 4.37 .567 .415
.25 .6 1.07 46.72 26.7 4.99 .746 .334
.25 .8 .261 31.04 8.80 5.60 .884 .240
.25 .9 .0736 21.85 3.50 5.91 .945 .180
.25 .97 .0101 12.22 .922 6.12 .984 .108
""".strip().splitlines()]  # fmt: skip

# Lund and Thomsen (1978), grooves of 20 degrees on both sides of the load: L/D, S, eccentricity,
# attitude [deg], Kxx Kxy Kyx Kyy, Cxx Cxy Cyy, threshold of a rigid rotor (own computation)
LUND_THOMSEN = [numbers(line) for line in """
.5 1.656 .244 65.85 1.69 5.06 -2.20 1.95 9.93 2.15 4.80 2.355
.5 .917 .372 57.45 2.12 4.01 -1.30 1.85 7.70 2.06 3.23 2.304
.5 .580 .477 51.01 2.67 3.70 -.78 1.75 6.96 1.94 2.40 2.300
.5 .379 .570 45.43 3.33 3.64 -.43 1.68 6.76 1.87 1.89 2.377
.5 .244 .655 40.25 4.21 3.74 -.13 1.64 6.87 1.82 1.54 2.618
1 .991 .150 70.58 1.56 7.29 -2.16 1.52 14.66 1.58 4.49 2.098
1 .635 .224 63.54 1.62 5.33 -1.57 1.56 10.80 1.70 3.41 2.107
1 .235 .460 49.27 2.19 3.57 -.80 1.55 7.36 1.89 2.19 2.105
1 .159 .559 44.33 2.73 3.36 -.48 1.48 6.94 1.78 1.74 2.162
1 .108 .650 39.72 3.45 3.34 -.23 1.44 6.89 1.72 1.43 2.321
""".strip().splitlines()]  # fmt: skip

# Lund and Thomsen (1978), two lobes of preload 0.5, L/D = 1, numbers on the clearance of an arc: S,
# eccentricity, attitude [deg], Kxx Kxy Kyx Kyy, Cxx Cxy Cyy
TWO_LOBED = [
    (.211, .260, 87.79, 6.65, 4.36, -3.21, .86, 13.09, -2.23, 3.70),
    (.120, .350, 81.80, 4.99, 3.54, -1.52, 1.14, 9.04, -.01, 2.49),
]  # fmt: skip

# one groove of 20 degrees, L/D = 0.5, S = 0.5: its angle from the load; law; eccentricity, attitude
# [deg], Kxx Kxy Kyx Kyy, threshold. Own computations with another program.
INLETS = [
    (180, "reynolds", .504, 55.1, 2.55, 3.65, -.93, 2.14, 2.57),
    (180, "jfo", .503, 53.5, 2.66, 3.58, -1.11, 2.18, 2.48),
    (-90, "reynolds", .509, 49.4, 2.84, 3.67, -.68, 1.76, 2.33),
    (-90, "jfo", .509, 49.1, 2.87, 3.64, -.65, 1.71, 2.32),
    (90, "reynolds", .504, 55.1, 2.55, 3.65, -.93, 2.14, 2.57),
    (90, "jfo", .556, 35.9, 5.30, 2.37, -1.13, 2.19, 3.26),
    (-45, "reynolds", .580, 38.6, 3.78, 4.78, -.30, 1.94, 2.06),
    (-45, "jfo", .611, 27.4, 4.92, 4.79, -.23, 1.02, 1.19),
    (135, "reynolds", .504, 55.1, 2.55, 3.65, -.93, 2.14, 2.57),
    (135, "jfo", .514, 46.9, 3.52, 3.25, -1.23, 2.16, 2.46),
]  # fmt: skip
