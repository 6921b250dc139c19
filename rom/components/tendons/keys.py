"""Tendons in mechanism files."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from rom.arguments import Positive, Quantity, Whole
from rom.config.keys import Key, Named, Table, nearest
from rom.config.laws import law_kind
from rom.config.mechanism_keys import DIRECTION, RADIUS, Markers, Section

if TYPE_CHECKING:
    from rom.config.connections import Entry

PULLEY = Table("A pulley in place of an eyelet.", (
    Key("radius", RADIUS, "Of the cable.", ...),
    Key("axis", DIRECTION, "In the world at the start; the cable goes around it in the positive "
        "sense.", ...),
    Key("friction", Quantity(), "Coefficient between cable and pulley.", 0.0),
    Key("turns", Whole(0), "Whole turns beyond the wrap of less than one.", 0),
))  # fmt: skip


def tendon(entry: "Entry") -> None:
    """A tendon of an entry."""
    from rom.components.tendons.tendons import Pulley

    values, pulleys = entry.values, entry.values.pop("pulleys")
    for key in ("free_length", "tension"):
        if isinstance(values.get(key), Mapping):
            values[key] = entry.law(key).value
    names = entry.marker_names
    for name in pulleys:
        if name not in names:
            place = entry.place.at("pulleys").at(name)
            raise place.error(f"{name!r} is no marker of the path.", nearest(name, names))
    path = [
        Pulley(marker, **pulleys[name]) if name in pulleys else marker
        for marker, name in zip(entry.ends, names, strict=True)
    ]
    entry.made.tendon(entry.name, path, **values)


SECTION = Section(
    "cables", Table("A cable through eyelets and over pulleys, which goes slack.", (
        Key("path", Markers(), "Markers in the order in which it passes them.", ...),
        Key("pulleys", Named(PULLEY, "pulleys"), "Which of these markers are pulleys.", {}),
        Key("EA", Positive("N"), "Force per strain; none if it is pulled."),
        Key("damping", Quantity("N s"), "Tension per rate of strain.", 0.0),
        Key("free_length", law_kind("m"), "Length without force, over time for a winch; that at "
            "the start if missing."),
        Key("pretension", Quantity("N"), "Tension at the start, in its place.", 0.0),
        Key("tension", law_kind("N"), "Force that pulls at its first end, in place of EA."),
        Key("friction", Quantity(), "Coefficient at all eyelets.", 0.0),
        Key("transition_speed", Positive("m/s"),
            "Of the sliding cable, over which friction turns."),
    )),
    tendon,
)  # fmt: skip
