"""Formulas in files: values, exact derivatives, and a grammar that nothing leaves."""

import ctypes
import math
import random

import numpy as np
import pytest
from numpy.testing import assert_allclose

import rom
from cases.files.toml_files import PENDULUM
from cases.refusals import refuses
from rom.config.document import parsed
from rom.config.expressions import MAX_LETTERS, Reader
from rom.config.keys import Place
from rom.mbs.elements.formulas.codes import FUNCTIONS
from rom.mbs.elements.formulas.programs import formula

VARIABLES = ("t", "x", "v")


def read(text, variables=VARIABLES, **constants):
    place = Place(parsed("[motors.m]\nlaw = 1\n", "p.toml"), ("motors", "m", "law"))
    return formula(Reader(text, variables, constants, place).code())


def smooth(s):
    return 10 * s**3 - 15 * s**4 + 6 * s**5


KNOWN = vars(math) | {  # what formulas say, in Python
    "sign": lambda x: math.copysign(1, x),
    "step": lambda t, a, b: smooth(min(max((t - a) / (b - a), 0), 1)),
}
CLOSED_FORMS = {  # formula: its first and second derivative by t, in closed form
    "t^3 - 2*t": ("3*t^2 - 2", "6*t"),
    "3/(1 + t^2)": ("-6*t/(1 + t^2)^2", "(18*t^2 - 6)/(1 + t^2)^3"),
    "30*sin(2*pi*t/0.5)": ("120*pi*cos(4*pi*t)", "-480*pi^2*sin(4*pi*t)"),
    "cos(t)*t": ("cos(t) - t*sin(t)", "-2*sin(t) - t*cos(t)"),
    "tan(t/2)": ("0.5/cos(t/2)^2", "0.5*tan(t/2)/cos(t/2)^2"),
    "asin(t/3)": ("(9 - t^2)^-0.5", "t*(9 - t^2)^-1.5"),
    "acos(t/3)": ("-((9 - t^2)^-0.5)", "-t*(9 - t^2)^-1.5"),
    "atan(t)": ("1/(1 + t*t)", "-2*t/(1 + t*t)^2"),
    "atan2(sin(3*t), cos(3*t))": ("3.0", "0.0"),
    "exp(-t^2)": ("-2*t*exp(-(t^2))", "(4*t^2 - 2)*exp(-(t^2))"),
    "log(1 + t)": ("1/(1 + t)", "-((1 + t)^-2)"),
    "sqrt(t)": ("0.5/sqrt(t)", "-0.25*t^-1.5"),
    "t^1.5": ("1.5*sqrt(t)", "0.75/sqrt(t)"),
    "2^t": ("log(2)*2^t", "log(2)^2*2^t"),
    "t^t": ("t^t*(log(t) + 1)", "t^t*((log(t) + 1)^2 + 1/t)"),
    "abs(t - 1)*t": ("copysign(2*t - 1, t - 1) if t > 1 else 1 - 2*t", "2.0 if t > 1 else -2.0"),
    "sign(t - 1)*t^2": ("copysign(2*t, t - 1)", "copysign(2, t - 1)"),
    "min(t, 1, t^2)": ("2*t if t < 1 else 0.0", "2.0 if t < 1 else 0.0"),
    "max(t^2, 1)": ("2*t if t > 1 else 0.0", "2.0 if t > 1 else 0.0"),
    "sinh(t) + 2*cosh(t)": ("cosh(t) + 2*sinh(t)", "sinh(t) + 2*cosh(t)"),
    "tanh(2*t)": ("2/cosh(2*t)^2", "-8*tanh(2*t)/cosh(2*t)^2"),
    "step(t, 0, 4)": ("30*(t/4*(1 - t/4))^2/4", "60*(t/4)*(1 - t/4)*(1 - t/2)/16"),
    "1 - step(t, 3, 1)": (
        "15*((t - 1)/2*(3 - t)/2)^2 if t > 1 else 0.0",
        "15*((t - 1)/2)*((3 - t)/2)*(2 - t) if t > 1 else 0.0",
    ),
}


@pytest.mark.parametrize("text", CLOSED_FORMS)
def test_values_and_derivatives_are_those_of_the_closed_form(text):
    found, t = read(text), np.array([0.13, 0.71, 1.27, 1.9])
    forms = text, *CLOSED_FORMS[text]
    for function, closed in zip((found, found.rate, found.acceleration), forms, strict=True):
        wanted = [eval(closed.replace("^", "**"), KNOWN | {"t": float(x)}) for x in t]
        assert_allclose(function(t), wanted, rtol=2e-13, atol=1e-13)
        assert function(0.71) == function(t)[1]


def test_a_motor_has_the_slopes_of_its_formula():
    """x^2 v^3 + t: 2 x v^3 by x, 3 x^2 v^2 by v; as compiled code asks for them."""
    found = read("x^2*v^3 + t")
    program, answer = np.concatenate([[found.program.size + 1.0], found.program]), np.zeros(3)
    kinds = [ctypes.c_double] * 3 + [ctypes.c_void_p] * 2
    asked = ctypes.CFUNCTYPE(None, *kinds)(found.address)
    asked(0.5, 3.0, -2.0, program.ctypes.data, answer.ctypes.data)
    assert_allclose(answer, [-71.5, -48.0, 108.0], rtol=1e-14)


def test_every_function_has_a_closed_form():
    assert all(any(f"{name}(" in text for text in CLOSED_FORMS) for name in FUNCTIONS)


def test_constants_stay_constants_where_slopes_are_infinite_and_huge_powers_are_numbers():
    found = read("sqrt(0) + 0^0.5 + abs(0) + t")
    assert (found(2.0), found.rate(2.0), found.acceleration(2.0)) == (2.0, 1.0, 0.0)
    assert read("9^9^9^9")(0.0) == math.inf
    assert read("2^-3^2")(0.0) == 2.0**-9


WORDS = ["t", "x", "v", "pi", "2", "0.5", "1e1", ".25", "k"]


def random_formula(chance, depth):
    if depth == 0:
        return chance.choice(WORDS)
    kind = chance.random()
    if kind < 0.5:
        sign = chance.choice(["+", "-", "*", "/", "**", " - -", "+ "])
        return f"{random_formula(chance, depth - 1)}{sign}{random_formula(chance, depth - 1)}"
    if kind < 0.6:
        return f"-{random_formula(chance, depth - 1)}"
    if kind < 0.8:
        return f"({random_formula(chance, depth - 1)})"
    name = chance.choice(["sin", "cos", "atan", "exp", "tanh", "abs"])
    return f"{name}({random_formula(chance, depth - 1)})"


def test_signs_bind_as_in_python():
    chance, same = random.Random(3), 0
    names = {key: getattr(math, key) for key in ("sin", "cos", "atan", "exp", "tanh", "pi")}
    names |= {"abs": abs, "t": 0.3, "x": 0.7, "v": 1.9, "k": 3.0}
    for _ in range(400):
        text = random_formula(chance, chance.randrange(1, 5))
        try:
            wanted = eval(text, {"__builtins__": {}}, names)  # what this test has made itself
        except (ArithmeticError, ValueError):
            continue
        if isinstance(wanted, complex) or abs(wanted) > 1e200:
            continue
        for written in (text, text.replace("**", "^")):
            assert_allclose(read(written, k=3.0)(0.3, 0.7, 1.9), wanted, rtol=1e-9, err_msg=text)
        same += 1
    assert same > 250


REFUSED = {  # formula: what is said of it, and the letter that the caret is under
    "": ("is empty", None),
    "sinn(t)": ("there is no 'sinn'", 0),
    "t.real": ("'.' has no meaning here", 1),
    "__import__('os')": ("there is no '__import__'", 0),
    "[t for t in x]": ("'[' has no meaning here", 0),
    "t := 1": ("':' has no meaning here", 2),
    "'text'": ('"\'" has no meaning here', 0),
    "t + \u03c0": ("'\u03c0' has no meaning here", 4),
    "\uff54": ("has no meaning here", 0),
    "t\0": ("has no meaning here", 1),
    "2t": ("a sign is missing between 2 and t", 1),
    "0x10": ("a sign is missing between 0 and x10", 1),
    "1..2": ("a sign is missing between 1. and .2", 2),
    "t t": ("this is no formula", 2),
    "01": ("this is no formula", 0),
    "1 +": ("this is no formula", None),
    "1 // t": ("this is nothing a formula has", 0),
    "max(*t, 1)": ("this is nothing a formula has", 4),
    "1, 2": ("a comma stands between arguments", 0),
    "(t": ("'(' was never closed", 0),
    "t)": ("unmatched ')'", 1),
    "sin": ("sin is a function", 0),
    "sin(t, x)": ("sin has 2 arguments; it takes 1", 0),
    "1 + step(t, 1)": ("step has 2 arguments; it takes 3", 4),
    "min(t)": ("min has 1 arguments; it takes 2 or more", 0),
    "t(2)": ("this is no function", 0),
    "1e999": ("this number is too large", 0),
    "(" * 401 + "t" + ")" * 401: ("this is no formula: too many nested parentheses", None),
    "-" * 900 + "t": ("nested", None),
    "t+" * 300 + "t": ("nested deeper than 200 levels", None),
    "t*(1+" * 39 + "t" + ")" * 39: ("more than 48 intermediate results", None),
    "t" * (MAX_LETTERS + 1): (f"has {MAX_LETTERS + 1} letters; {MAX_LETTERS} are the most", None),
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("text", REFUSED, ids=lambda text: ascii(text[:20]))
def test_what_is_no_formula_is_refused_with_its_place(text):
    message, at = REFUSED[text]
    with pytest.raises(rom.ConfigError) as refused:
        read(text)
    error = refused.value
    assert message in error.message and error.where == "p.toml:2"
    assert error.message.startswith("motors.m.law")
    if at is not None:
        *_, line, caret = error.message.split("\n")
        assert caret == " " * (4 + at) + "^"
        assert line[: 4 + at].strip() == text[:at].strip()


def test_the_nearest_name_is_offered():
    refuses(rom.ConfigError, "Did you mean stiffness?", read, "2*stifness*x", stiffness=3.0)
    refuses(rom.ConfigError, "there is no 'x'", read, "x", ("t",))


LETTERS = "txv0123456789.eE+-*/^(), \tsincoslogabsminmaxstep_'\"[]{}:=<>!@#$%&|~`\\\u00e9\u03c0\x00"


def test_noise_is_refused_or_a_number():
    chance, legal = random.Random(11), 0
    for _ in range(4000):
        n = chance.randrange(1, 25)
        text = "".join(chance.choices(LETTERS[:25], k=n) if chance.random() < 0.5
                       else chance.choices(LETTERS, k=n))  # fmt: skip
        try:
            found = read(text)
        except rom.ConfigError as error:
            assert error.message.startswith("motors.m.law") and error.where == "p.toml:2"
        else:
            assert isinstance(found(0.1, 0.2, 0.3), float)
            legal += 1
    assert legal > 20


@pytest.mark.parametrize(
    ("section", "expression", "message"),
    [
        ("drives", "2 + 1/(t - 0.5)", "function of 'm'"),
        ("motors", "log(0.5 - t)", "law of 'm' gives no finite number"),
    ],
)
def test_a_value_that_is_not_finite_is_told_with_the_time(section, expression, message, tmp_path):
    law = f'[{section}.m]\njoint = "pivot"\nlaw = {{ expression = "{expression}" }}\n'
    (tmp_path / "p.toml").write_text(PENDULUM + law)
    with pytest.raises(rom.RomError, match=message) as refused:
        rom.read_mechanism(tmp_path / "p.toml").simulate()
    assert "t = 0.5" in str(refused.value) and refused.value.solution.t[-1] <= 0.5
