"""What joints and elements need to know of the mechanism that they enter."""

from collections.abc import Callable
from typing import Any, Protocol

from rom.mbs.parts.bodies import Marker, Part
from rom.mbs.parts.joints import Joint
from rom.model import Array


class Whole(Protocol):
    """A `rom.mbs.mechanism.Mechanism`, whose methods the functions on it become.

    Attributes:
        parts, joints, drives: {name: body, joint or drive}.
        elements: {name: (family, element)}.
    """

    parts: dict[str, Part]
    joints: dict[str, Joint]
    drives: dict[str, Any]
    elements: dict[str, tuple[Any, Any]]

    @property
    def spherical(self) -> Callable[[str, Marker, Marker], None]:
        """Make a ball joint."""

    @property
    def law(self) -> Callable[..., None]:
        """Add a law of force, see `rom.mbs.elements.laws.law`."""

    def add(self, name: str, element: Any, family: Any) -> None:
        """Enter an element."""

    def part(self, name: str) -> Part:
        """The body of a name."""

    def design_point(self, marker: Marker) -> Array:
        """(3,) position of a marker where its body was added."""

    def check_new(self, name: str) -> None:
        """Refuse a name in use."""

    def check_markers(self, name: str, *markers: Marker) -> None:
        """Refuse markers that do not exist."""

    def check_apart(self, name: str, m1: Marker, m2: Marker) -> None:
        """Refuse such markers, or both of one body."""
