"""Reduction methods by name."""

from importlib import import_module
from typing import TYPE_CHECKING

from rom.config.document import Values
from rom.errors import ConfigError

if TYPE_CHECKING:
    from rom.reduction.bases.method import Method
    from rom.reduction.interfaces.characteristic import Characteristic

CRAIG_BAMPTON = "craig-bampton"
METHODS = {  # name: module, class, and how many modes when nobody says; None for none
    CRAIG_BAMPTON: ("method", "CraigBampton", "enough"),
    "enhanced": ("enhanced", "EnhancedCraigBampton", 20),
    "guyan": ("method", "Guyan", None),
    "rubin": ("free_interface", "Rubin", 20),
    "herting": ("free_interface", "Herting", 20),
    "free-free": ("free_interface", "FreeFree", 20),
    "assumed": ("assumed", "AssumedModes", 20),
    "moment-matching": ("krylov", "MomentMatching", 2),
    "balanced": ("balanced", "BalancedTruncation", 20),
}

OWN_SETTINGS = {"f_max": CRAIG_BAMPTON, "tol": CRAIG_BAMPTON, "at": "moment-matching"}
SETTINGS = ("method", "modes", *OWN_SETTINGS, "characteristic", "gravity_shapes")


def chosen(settings: Values, *, full: bool) -> "Method | Characteristic":
    """The method of a table [reduction], by the keys of `SETTINGS` that somebody chose."""
    from rom.reduction.bases.method import WithLoads
    from rom.reduction.interfaces.characteristic import Characteristic

    method = _plain(settings)
    if settings.get("gravity_shapes"):
        method = WithLoads(method)
    if "characteristic" not in settings:
        return method
    if not full:
        raise ConfigError("characteristic needs a full interface.")
    return Characteristic(method, settings["characteristic"])


def _plain(settings: Values) -> "Method":
    name = settings["method"]
    module, kind, default = METHODS[name]
    modes, f_max = settings.get("modes"), settings.get("f_max")
    for key, owner in OWN_SETTINGS.items():
        if key in settings and name != owner:
            raise ConfigError(f"{key} belongs to {owner}, not to {name}; leave it out.")
    if modes is not None and {"f_max", "tol"} & set(settings):
        raise ConfigError(f"{name} has {'tol' if f_max is None else 'f_max'}; leave modes out.")
    if modes is not None and default is None:
        raise ConfigError(f"{name} keeps no modes; leave modes out.")
    make = getattr(import_module(f"rom.reduction.bases.{module}"), kind)
    if name == CRAIG_BAMPTON:
        return make(modes, f_max, settings.get("tol"))
    if name == "moment-matching":
        return make(tuple(settings.get("at", (0.0,))), modes or default)
    return make() if default is None else make(default if modes is None else modes)
