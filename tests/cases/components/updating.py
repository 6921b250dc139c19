"""Families of steel blocks to be updated, and their tests with noise."""

import numpy as np
from numpy.testing import assert_allclose

import rom
from cases.refusals import refuses
from cases.solid import KINDS, STEEL, composite
from rom.components.updating.family_model import Parts, family_model
from rom.components.updating.frf_data import estimators, noisy
from rom.components.updating.normal_equations import responses_at
from rom.components.updating.observers.operation import discrete
from rom.errors import ConfigError
from rom.updating import Channels, JointSpring, Responses

BEAM = (1.0, 0.1, 0.08)
BOLTS = JointSpring(("frame", "tip"), ("arm", "root"), (4e8, 4e8, 4e8, 2e5, 1e5, 1e5), 0.1, 10.0)
PARAMETERS = {f"E_{name}": rom.YoungsModulus(name, 0.4, 2.5) for name in ("inner", "outer")}
PARAMETERS |= {"rho_outer": rom.Density("outer", 0.5, 2.0)}


def refuse(*rows, error=ConfigError):
    """See that each call is refused: the call, the class where it is another one, and words."""
    for call, *kind, words in rows:
        refuses(*kind or [error], words, call)


def crossed(points, bodies=None):
    axes = np.tile([[0, 1, 0], [0, 0, 1]], (len(points), 1))
    return Channels(np.repeat(points, 2, axis=0), axes, bodies)


def assert_right(found, true):
    """Factors that were found within four of their deviations."""
    for name, value in true.items():
        assert abs(np.log(found.factors[name] / value)) < 4 * found.deviations[name]


def assert_alike(one, other, names, atol):
    """Records of filters are the same, over the largest of each number."""
    for name in names:
        scale = np.abs(getattr(other, name)).max(axis=0)
        assert_allclose(getattr(one, name) / scale, getattr(other, name) / scale, atol=atol)


def family_of(parameters, cells, n_modes, regions=("inner", "outer"), *, size=BEAM, **options):
    """Family of a block whose length its regions share along x, uncertified.

    Options are its ``origin`` [m], and those of `rom.reduce_parametric`.
    """
    origin = options.pop("origin", (0.0, 0.0, 0.0))
    parts, n = dict.fromkeys(regions, STEEL), len(regions)
    model = composite(parts, lambda c: regions[n * c[0] // cells[0]], size, cells, origin)
    options = {"interfaces": KINDS, "certify": False, "method": rom.CraigBampton(n_modes)} | options
    return rom.reduce_parametric(model, parameters=parameters, **options)


def halves(n_modes=12):
    made = {}
    for name, x in (("frame", 0.0), ("arm", 0.5)):
        modulus, place = {"E": rom.YoungsModulus(name, 0.3, 3.0)}, {"origin": (x, 0, 0)}
        made[name] = family_of(modulus, (4, 1, 1), n_modes, (name,), size=(0.5, 0.1, 0.08), **place)
    return made


def model_of(family, channels, fixed, attached=None, candidates=None):
    """The equations of a family, or an assembly of some, at its sensors and inputs."""
    bodies = Parts.of(family).bodies
    bodies = bodies if len(bodies) > 1 or "" not in bodies else bodies[""]
    rows = [side.rows(bodies, "channel") for side in channels]
    return family_model(family, rows, attached or {}, candidates or {}, fixed)


def exact_responses(model, true, lines, zeta=0.02):
    """(n_f, n_s, n_e) responses at factors {name: value} and one damping ratio."""
    x = np.log([true.get(name, 1.0) for name in model.names])
    return responses_at(model, x, np.array([zeta]), 2 * np.pi * np.asarray(lines))


def noisy_test(family, true, channels, lines, *, level, averages, seed=0, **model):
    """A test with relative noise: coherence c of n averages has the error (1 - c) / (2 n c)."""
    H = exact_responses(model_of(family, channels, **model), true, lines)
    H = noisy(H, level, np.random.default_rng(seed)) if level else H
    c = 1 / (1 + averages * level**2) if level else 0.999  # level^2 / 2 for each part
    return Responses(lines, H, *channels, c, averages)


def fed(one, sensors, samples, wanted, dt, first=0):
    """What the FMU of a filter answers after each sample of its sensors."""
    rows = []
    for k, sample in enumerate(samples, first):
        for name, value in zip(sensors, sample, strict=True):
            one.set(f"sensor.{name}", value)
        one.fmu.doStep(k * dt, dt)
        rows.append(one.get(*wanted))
    return np.array(rows)


def walked(t, rng, n_t, every=50):
    """A record of what a filter assumes: logarithms of factors, values, and samples.

    Parameters walk every so many steps, as far as they do in that time.
    """
    o, first = t.operation, np.array([d.first for d in t.drifts.values()])
    walk = np.array([d.walk for d in t.drifts.values()])
    P = t.assumed.before(o)
    x = np.sqrt(np.diag(P)) * rng.standard_normal(len(P))
    p = first * rng.standard_normal(len(first))
    factors, values, clean = [], [], []
    for k in range(n_t):
        if k % every == 0:
            p = p + (k > 0) * walk * np.sqrt(every * t.assumed.dt) * rng.standard_normal(len(p))
            at, step, root = stepped(t, p)
        factors.append(p)
        values.append(at.W @ x)
        clean.append(at.C @ x)
        x = step @ x + root @ rng.standard_normal(len(x))
    clean = np.array(clean)
    y = clean + np.sqrt(t.R) * rng.standard_normal(clean.shape)
    return np.array(factors), np.array(values), y


def stepped(t, p):
    """The equations, transition and root of the noise of a step at logarithms p of factors.

    The symmetric root of a matrix that is nearly singular is the same on any machine.
    """
    at = t.operation.at(p)
    step, Q = discrete(at.A, t.assumed.white(t.operation), t.assumed.dt)
    scale = np.sqrt(np.diag(Q))
    lam, V = np.linalg.eigh(Q / np.outer(scale, scale))
    return at, step, scale[:, None] * (V * np.sqrt(np.maximum(lam, 0.0))) @ V.T


def gauss(rng, shape):
    """Circular complex numbers of the variance one."""
    return (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)


def averaged(exact, channels, lines, rng, *, noise, n, estimator="H1"):
    """A test by n records: one force drives all sensors, its noise is in all responses."""
    on_force, on_response = noise
    f = gauss(rng, (n, len(lines), 1, exact.shape[2]))
    x = exact * (f + on_response * gauss(rng, (n, *exact.shape)))
    f = f + on_force * gauss(rng, f.shape)
    *H, coherence = estimators(x, np.broadcast_to(f, x.shape))
    H = H[("H1", "H2", "Hv").index(estimator)]
    kind = {"force_noise": on_force, "estimator": estimator}
    return Responses(lines, H, *channels, coherence, n, **kind)
