"""Wrong arguments of all public callables: legal, or a mistake of the user that is named."""

import inspect
import signal
import sys
import warnings
from collections import Counter
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from itertools import product
from operator import attrgetter
from pathlib import Path
from pkgutil import resolve_name
from typing import get_args

import numpy as np
import pytest

import rom
import rom.view
from cases.files.border_calls import SKIPPED, body, calls, mistuned
from cases.files.docstrings import public
from cases.paths import ROOT
from cases.refusals import refuses
from rom.arguments.border import _Border, _taken
from rom.arguments.kinds import Unfit, parameters_of

SECONDS = 5.0  # a wrong argument is refused before work starts
WRONG = {str(x): x for x in (None, -1, 0, 1.5, np.nan, np.inf, True)} | {
    "text": "no such name",
    "million": 10**6,
    "1e300": 1e300,
    "10**400": 10**400,
    "complex": 1j,
    "bytes": b"x",
    "empty list": [],
    "empty dict": {},
    "a dict": {"root": 3},
    "object": object(),
    "function": lambda *_: None,
    "ragged": [[1, 2], [3]],
    "five numbers": np.zeros(5),
    "numbers with nan": [np.nan, 0.0, 1.0],
    "texts": ["no", "such"],
    "a matrix": np.ones((40, 40)),
}
BEYOND = {  # wrong values that annotations do not rule out: arguments by which they are refused
    ("-1",): "simulate.t_end modes.f_max equilibrium.steps write_animation.frames Density.low "
    "craig_bampton.n_modes second_order_balanced_truncation.r "
    "FlexibleBody.frequencies.n BalancedTruncation.pool Polynomial.order",
    ("-1", "0"): "modes.n write_history.every Solution.to_pandas.every Characteristic.n "
    "Snapshots.n Assembly.reduced.n_interface Material.E Material.rho",
    ("-1", "0", "1.5"): "Snapshots.energy",
    ("1.5", "five numbers", "a matrix"): "Mechanism.gravity Mechanism.force.vector "
    "equilibrium.spin campbell.axis write_animation.up",
    ("text",): "modes.fixed Mechanism.rotational_spring.joint Mechanism.drive.joint export.to "
    "FlexibleBody.frequencies.fixed FlexibleBody.in_units.units Assembly.reduced.level",
    ("1.5", "text"): "reduce.reference FlexibleBody.with_reference.reference",
    ("None", "1.5", "text"): "linearize.frame check.record craig_bampton.K",
    ("text", "nan", "five numbers", "complex"): "Mechanism.force.vector",
}
REFUSED_AS_THEY_ARE = set(  # legal calls that lack more than arguments: a file, a mesh, a film
    "FlexibleBody.critical_loads "
    "FlexibleBody.equilibria Mechanism.capsule_on_capsule Mechanism.distance Mechanism.fmu "
    "Mechanism.law "
    "certify_pieces read_component read_mechanism surface_load "
    "write_body_fmu write_fmu write_mechanism_fmu write_stress write_stress_history "
    "Solution.element Solution.law Solution.stress Solution.to_pandas "
    "Solution.to_xarray".split()
)
# pairs of argument and value, fewer without finite elements; a lost annotation takes some away
LEAST_RULED_OUT = 34_795 if find_spec("dolfinx") else 34_370
COUNTED = Counter()
BORDER = rom.simulate.__code__  # of what `typed` makes of a function


class TooSlow(Exception):
    """A call took longer than it may."""


@contextmanager
def limited(seconds):
    def stop(number, frame):
        raise TooSlow

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def beyond(label):
    """{(argument, wrong value)} that a callable may not take although its annotations would."""
    found = set()
    for kinds, names in BEYOND.items():
        arguments = (name.rpartition(".") for name in names.split())
        found |= set(product([argument for own, _, argument in arguments if own == label], kinds))
    return found


def ruled_out(function):
    """Pairs of argument and wrong value that the annotations of a typed function rule out."""
    takes = _Border(inspect.unwrap(getattr(function, "__func__", function))).takes
    for (argument, take), (kind, wrong) in product(takes.items(), WRONG.items()):
        try:
            _taken(argument, take, wrong)
        except Unfit:
            yield argument, kind


def outcome(function, given, wrong, argument, must):
    """What is wrong with the answer to a wrong value, or nothing."""
    COUNTED["cases"] += 1
    try:
        with limited(SECONDS), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            function(**given | {argument: wrong})
    except rom.RomError as error:
        COUNTED["refused"] += 1
        COUNTED["named"] += argument in str(error)
        return f"exit code 1: {error}" if error.exit_code == 1 else None
    except TooSlow:
        return f"still busy after {SECONDS:g} s"
    except Exception as error:
        frames = inspect.getinnerframes(error.__traceback__)
        place = f"{Path(frames[-1].filename).name}:{frames[-1].lineno}"
        return f"{type(error).__name__}: {error} ({place})"
    COUNTED["legal"] += 1
    return "is taken" if must else None


@pytest.mark.once
@pytest.mark.parametrize("label", calls())
def test_a_wrong_argument_is_a_mistake_of_the_user_and_named(label, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    make, arguments = calls()[label]
    COUNTED["callables"] += 1
    function, legal_call = make()
    # compiles what is not yet, untimed
    with suppress(*[rom.RomError] * (label in REFUSED_AS_THEY_ARE)), warnings.catch_warnings():
        warnings.simplefilter("ignore")
        function(**legal_call)
        if label == "simulate":
            function(**legal_call | {"dt": None})
    found, made, legal = {}, make(), COUNTED["legal"]
    refused = beyond(label)
    assert {argument for argument, _ in refused} <= {p.name for p in arguments}
    for argument in (p.name for p in arguments):
        for kind, wrong in WRONG.items():
            if kind not in SKIPPED.get((label, argument), ()):
                must = (argument, kind) in refused
                found[f"{argument}={kind}"] = outcome(*made, wrong, argument, must)
            if COUNTED["legal"] > legal and label.startswith("Mechanism."):  # it has changed
                made, legal = make(), COUNTED["legal"]
    bad = [f"{label}: {case}: {what}" for case, what in found.items() if what]
    assert not bad, "\n".join(bad)


def at_the_border():
    """(full name, typed function) of what all fronts show; methods as functions of None."""
    for name in public():
        thing = attrgetter(name.removeprefix("rom."))(rom) if ".fe." in name else resolve_name(name)
        called = thing.__init__ if inspect.isclass(thing) else thing
        if getattr(getattr(called, "__func__", called), "__code__", None) is BORDER:
            (own, *_) = [*inspect.signature(called).parameters.values(), None]
            of_none = own and own.name == "self" and own.annotation is own.empty
            yield name, called, (None,) * bool(of_none)


@pytest.mark.once
def test_every_function_refuses_what_its_annotations_rule_out():
    ruled, bad = 0, []
    for name, function, own in at_the_border():
        for argument, kind in ruled_out(function):
            ruled += 1
            try:
                function(*own, **{argument: WRONG[kind]})
            except rom.RomError as error:
                bad += [f"{name}: {argument}={kind}: {error}"] * (argument not in str(error))
            else:
                bad.append(f"{name}: {argument}={kind} is taken")
    assert not bad, "\n".join(bad)
    assert ruled >= LEAST_RULED_OUT


def limits(annotation):
    """What numbers an annotation takes, however deep inside it says so."""
    for limit in (x for x in getattr(annotation, "__metadata__", ()) if hasattr(x, "holds")):
        words = getattr(limit, "words", limit.summary)
        yield f"{words} ({limit.error.__name__})"
    for inner in get_args(annotation):
        yield from limits(inner)


@pytest.mark.once
def test_limits_and_units_of_numbers_are_those_on_record():
    """One line an argument: whoever widens a limit or changes a unit changes that line too."""
    found = set()
    for _, function, _ in at_the_border():
        plain = inspect.unwrap(getattr(function, "__func__", function))
        for p in parameters_of(plain):
            found.update(f"{plain.__qualname__} {p.name}: {x}" for x in limits(p.annotation))
    record = set((ROOT / "tests/reference/limits.txt").read_text().splitlines())
    assert not found - record, f"not on record: {sorted(found - record)}"
    gone = record - found if find_spec("dolfinx") else set()  # without it some are not there
    assert not gone, f"on record alone: {sorted(gone)}"


@pytest.mark.once
def test_nearly_every_refusal_names_the_argument(capsys):
    if not COUNTED["callables"]:
        pytest.skip("counts the cases of the test above")
    share = COUNTED["named"] / COUNTED["refused"]
    with capsys.disabled():
        sys.stdout.write(f"\n{dict(COUNTED)}: {share:.1%} of the refusals name the argument\n")
    assert share > 0.97


def test_missing_arguments_are_a_type_error_of_python():
    refuses(TypeError, "", rom.save)
    refuses(rom.ConfigError, "", rom.save, body=1, path="x", ending=".npz")
    refuses(TypeError, "unexpected keyword", rom.save, body(), "x", ending=".npz")


def test_large_deflection_is_refused_by_name_where_it_is_not_taken():
    loads = rom.Geometric({"tip": (0, 1.0, 0, 0, 0, 0)})
    for function in (rom.reduce_parametric, rom.reduce_sector, rom.linearize):
        words = rf"{function.__name__}: .* is for rom\.reduce, .*out"
        refuses(rom.ConfigError, words, function, nonlinear=loads)


def test_forces_with_a_phase_are_numbers():
    force = np.array([0.0, 1j, 0.0])
    sweep = {"engine_order": 1, "omega": [5e3], "damping": 1e-3, "at": [1]}
    turned, plain = (mistuned().response(np.zeros(4), f, **sweep) for f in (force, abs(force)))
    np.testing.assert_allclose(turned, 1j * plain, rtol=1e-12)


@pytest.mark.fenicsx
def test_forms_need_a_compiler_and_say_which(monkeypatch, tmp_path):
    from mpi4py import MPI

    from rom.fe.jit import compiling

    monkeypatch.setenv("CC", str(tmp_path / "gcc"))
    with pytest.raises(rom.ResourceError, match=r"C compiler.*gcc.*apt-get install gcc"):
        with compiling(MPI.COMM_SELF):
            raise RuntimeError("command failed")
    monkeypatch.delenv("CC")
    with pytest.raises(RuntimeError, match="something else"), compiling(MPI.COMM_SELF):
        raise RuntimeError("something else")
