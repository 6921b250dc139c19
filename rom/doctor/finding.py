"""One line of the doctor's report."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing looked at.

    Attributes:
        topic: heading it stands under.
        name: what was looked at.
        value: version, place or number found.
        state: "ok"; "note": works, and could be better; "missing": a part of rom cannot be used;
            "broken": installed or found, and does not work.
        advice: what to type.
    """

    topic: str
    name: str
    value: str
    state: str = "ok"
    advice: str = ""
