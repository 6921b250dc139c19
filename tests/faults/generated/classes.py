"""All cases by class."""

from importlib import import_module

from generated.case import Case, by_id

CLASSES = {  # number of the class: what it is about, and its modules
    "1": ("code from the working folder", ("cases_code",)),
    "2": ("names as paths", ("cases_names",)),
    "3": ("geometries as programs", ("cases_geometry", "cases_meshes")),
    "4": ("motion lost", ("cases_motion",)),
    "5": ("silent wrong physics", ("cases_physics",)),
    "6": ("blame", ("cases_calls", "cases_documents", "cases_files")),
    "7": ("bounds", ("cases_bounds",)),
    "8": ("alone and together", ("cases_together",)),
    "R": ("odd cases of the reliability table", ("cases_reliability", "cases_reliability_models")),
}


def all_cases() -> dict[str, Case]:
    """{id: case}, in order."""
    found: dict[str, Case] = {}
    for letter, (_, modules) in CLASSES.items():
        cases = [one for m in modules for one in import_module(f"generated.{m}").CASES]
        found |= by_id(letter, cases)
    return found


def planted() -> dict[str, Case]:
    """Cases whose verdict is known, for the test of the judge."""
    return by_id("J", import_module("generated.cases_planted").CASES)
