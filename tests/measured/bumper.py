"""The frame on rails with a stop between its upper floors, shaken at random: peaks shift."""

import numpy as np
from measured.lanl import FLOORS, SIDE, frame, swaying
from measured.record import Numbers, Structure

import rom

# a column that hangs from the top floor knocks on a stop on the floor below; gap [mm]
GAPS = {"S10": 0.20, "S11": 0.15, "S12": 0.13, "S13": 0.10, "S14": 0.05}
RATE, LENGTH, BAND, WINDOW = 2048.0, 24.0, (20.0, 150.0), 4096  # [Hz, s, Hz, samples]
RAIL, STOREY = 360.0, 12.0  # dampers [N s/m]: ratios of S1 are 6.3, 2.0 and 0.97 %
SEEDS = 2


def masses(mech):
    """(4,) of the floors, each with half of the columns that meet it [kg]."""
    columns = sum(part.mass for name, part in mech.parts.items() if "column" in name) / 3
    return np.array([mech.parts[f"floor {k}"].mass for k in FLOORS]) + columns * np.array(
        [0.5, 1.0, 1.0, 0.5]
    )


def chain(gap=None, *, contact=2.1e6, offset=0.0, rail=13.5e3, push=None):
    """Four masses on a rail with the first swaying frequency of the whole frame."""
    whole = frame(2)
    target, m = swaying(whole)[0][0], masses(whole)
    links = np.diff(np.eye(4), axis=0)
    low, high = 1e5, 1e6
    while high / low > 1 + 1e-9:  # frequencies rise with the stiffness
        k = np.sqrt(low * high)
        K = k * links.T @ links + rail * np.diag([1.0, 0, 0, 0])
        lam = np.linalg.eigvalsh(K / np.sqrt(np.outer(m, m)))
        low, high = (k, high) if np.sqrt(lam[1]) < 2 * np.pi * target else (low, k)
    mech = rom.Mechanism(gravity=(0, 0, 0))
    for i in FLOORS:
        mech.add_rigid(f"floor {i}", mass=m[i], inertia=[m[i] * SIDE**2] * 3, at=(i, 0, 0),
                       markers={"centre": (0, 0, 0)})  # fmt: skip
    ends = [mech.ground.marker((-1.0, 0, 0)), *(mech.marker(f"floor {i}.centre") for i in FLOORS)]
    laws = [(rail, RAIL)] + [(k, STOREY)] * 3
    for i, (stiffness, damping) in enumerate(laws):
        mech.prismatic(f"slide {i}", *ends[i : i + 2], axis=(1, 0, 0))
        mech.spring_damper(f"storey {i}", *ends[i : i + 2], stiffness=stiffness, damping=damping)
    if gap is not None:
        knock = rom.mbs.Impact(contact, exponent=1.0, restitution=0.7, impact_speed=0.02)
        mech.stop("bumper", "slide 3", knock, lower=-1e-3 * gap - offset)
    if push is not None:
        mech.force("shaker", ends[1], push)
    return mech


def excitation(force, rng):
    """Band-limited random force of an effective value [N], sampled at the rate."""
    n = round(RATE * LENGTH)
    f = np.fft.rfftfreq(n, 1 / RATE)
    line = np.exp(2j * np.pi * rng.random(f.size)) * ((f >= BAND[0]) & (f <= BAND[1]))
    x = np.fft.irfft(line, n)
    return force * x / x.std()


def response(steps, gap, *, force, seed=0, **given):
    """(n_f,) lines [Hz] and (n_f, 4) accelerances, H1 from overlapping windows."""
    x = excitation(force, np.random.default_rng(seed))
    period = LENGTH * RATE

    def push(t):
        at = t * RATE % period
        k = int(at)
        a, b = x[k % x.size], x[(k + 1) % x.size]
        return a + (at - k) * (b - a), 0.0, 0.0

    sol = rom.simulate(chain(gap, push=push, **given), t_end=LENGTH, dt=1 / RATE / steps,
                       save_every=steps, rho_inf=0.9)  # fmt: skip
    moved = sol.a[: x.size, ::6]
    window = np.hanning(WINDOW)
    cross, power = 0.0, 0.0
    for start in range(WINDOW, x.size - WINDOW + 1, WINDOW // 4):
        piece = slice(start, start + WINDOW)
        A = np.fft.rfft(window[:, None] * moved[piece], axis=0)
        F = np.fft.rfft(window * x[piece])
        cross, power = cross + F.conj()[:, None] * A, power + np.abs(F) ** 2
    f = np.fft.rfftfreq(WINDOW, 1 / RATE)
    kept = (f > BAND[0] + 2) & (f < BAND[1])
    return f[kept], (cross / power[:, None])[kept]


def peaks(f, H, near):
    """Frequencies [Hz] of one pole each, fitted to all responses around the highest lines."""
    found, power = [], (np.abs(H) ** 2).sum(axis=1)
    for guess in near:
        some = np.flatnonzero((f > 0.92 * guess) & (f < 1.15 * guess))
        top = f[some[power[some].argmax()]]
        some = (f > 0.93 * top) & (f < 1.07 * top)
        s, h = 1j * f[some] / top, H[some]
        # (s^2 + a s + b) h = c + d s + e s^2, with a and b real and common to all floors
        own = np.vander(s, 3).astype(complex)
        rest = np.eye(len(s)) - own @ np.linalg.pinv(own)
        left = rest @ np.concatenate([s[:, None] * h, h]).reshape(2, len(s), -1)
        right = -(rest @ (s[:, None] ** 2 * h)).ravel()
        A = left.reshape(2, -1).T
        parts = np.vstack([A.real, A.imag]), np.r_[right.real, right.imag]
        found.append(top * np.sqrt(np.linalg.lstsq(*parts, rcond=None)[0][1]))
    return np.array(found)


def frequencies(steps, *, draw, again, **given) -> Numbers:
    """Peaks of the states with a stop over those of S1 without one, shaken alike."""
    near = rom.linearize(chain()).frequencies[1:4]
    seeds = [2 * round(draw) + k for k in range(SEEDS)]

    def mean(gap):
        return np.mean([peaks(*response(steps, gap, seed=k, **given), near) for k in seeds], axis=0)

    first = mean(None)
    return {
        f"{name} over S1, mode {k} [1]": float(again * r)
        for name, gap in GAPS.items() for k, r in enumerate(mean(gap) / first, 1)
    }  # fmt: skip


BUMPER = Structure(
    "lanl_bumper",
    frequencies,
    {"force": (20.0, 8.0), "contact": (2.1e6, 1e6), "offset": (0.0, 2e-5), "draw": (1.0, 1.0),
     "again": (1.0, 0.005)},
    (1, 2),
    """Four masses on the rails, with springs that give S1 its first frequency as predicted, and
dampers its damping. The effective force, 20 N between 20 and 150 Hz, is from memory; the stop is
as stiff as a cantilever of aluminium 150 mm long and 25.4 mm square. Frequencies are those of one
pole each, fitted to responses H1 by the source's kind of excitation: of a mechanism that knocks
they depend on its level. "draw" takes other random forces, "again" is how well a test repeats.""",
)  # fmt: skip
