"""Keys of round bodies of all kinds."""

from rom.config.keys import Key, Quantity

TWO, LENGTH = ((2,),), Quantity("m", positive=True)
STEEL = (
    Key("E", Quantity("Pa", positive=True), "Young's modulus.", 206e9),
    Key("nu", Quantity(), "Poisson's ratio.", 0.3),
)
