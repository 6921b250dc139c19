"""Tendons in mechanism files."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from rom.config.declared import Declared
from rom.config.keys import Key, Named, nearest
from rom.config.laws import law_kind
from rom.config.mechanism_keys import Markers, Section

if TYPE_CHECKING:
    from rom.config.connections import Entry

PULLEY = Declared(
    "rom.components.tendons.tendons:Pulley",
    about="A pulley in place of an eyelet.",
    without="marker",
)


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
    "cables",
    Declared(
        "tendon",
        Key("path", Markers(), "Markers in the order in which it passes them.", ...),
        Key("pulleys", Named(PULLEY, "pulleys"), "Which of these markers are pulleys.", {}),
        free_length=law_kind("m"),
        tension=law_kind("N"),
    ),
    tendon,
)
