"""Where cases of a test run."""

import pytest


def where_they_run(modules):
    """Cases of a test of modules: those of rom.fe import dolfinx."""
    fe = [[pytest.mark.fenicsx] * (name.split(".")[:2] == ["rom", "fe"]) for name in modules]
    return [pytest.param(name, marks=marks) for name, marks in zip(modules, fe, strict=True)]
