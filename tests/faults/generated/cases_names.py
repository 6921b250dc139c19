"""Several things that are missing or misspelt at once: all of them are named."""

import rom
from generated.case import case, edit
from generated.stock import STEEL
from rom.errors import ConfigError, InterfaceError, ModelError, ParameterError

MISSING = {  # command lines that lack several things, and all of them
    "modes": ("modes box.msh --nu 0.3", ("--E", "--rho")),
    "reduce": (f"reduce box.msh {STEEL}", ("-i", "-o")),
    "simulate": ("simulate good.npz", ("--hinge", "--t-end", "--dt", "-o")),
    "swing": ("swing box.msh", ("--hinge", "-o")),
    "export": ("export", ("file", "output")),
}
CASES = [
    *(case(f"rom {verb} without several things", line, ConfigError, *words)
      for verb, (line, words) in MISSING.items()),
    case("two sets that are not there", "reduce K.mtx --mass M.mtx --nodes deck.inp -i rot=rbe2 "
         "-i tipp=rbe2 -o a.npz", (ConfigError, InterfaceError, rom.errors.FileFormatError), "rot",
         "tipp"),
    case("two parameters that are not there", lambda folder: rom.load("family.npz").at(rhoo=1, E=2),
         ParameterError, "rhoo", "E"),
    case("two keys that are not there", "simulate pendulum.toml -o out", ConfigError, "masss", "atx",
         given=(edit("pendulum.toml", "mass =", "masss ="), edit("pendulum.toml", "at =", "atx ="))),
    case("two markers that are not there", "simulate pendulum.toml -o out", (ConfigError, ModelError),
         "'pm'", "'pn'", given=edit("pendulum.toml", '{ ground = [0, 0, 0] }, "bob.pin"', '"bob.pm", "bob.pn"')),
    case("a parent that is a file", "export good.npz good.npz/x.vtu", ConfigError, "good.npz"),
]  # fmt: skip
