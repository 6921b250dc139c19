"""Names of bodies, markers, joints and their like, and the file names made from them.

A name is shown in tables, pictures and messages, becomes part of XML, HTML and input decks, and
may become a file name; so it is one line of text that can be seen and cannot lead elsewhere:

- 1 to 120 characters: letters, digits, marks, punctuation and symbols of any script, and spaces;
- no control and no invisible characters: line ends, NUL, changes of the direction of writing;
- where it is given, not where it is read from older files or other programs: no slash and no
  backslash, no dot, dash or space in front, no space at the end.
"""

import unicodedata
from collections import Counter
from collections.abc import Iterable
from difflib import get_close_matches
from pathlib import Path

from rom.errors import ConfigError, RomError

ORIGIN_MARK = "written by rom"  # stands in every file of a format that has comments
MAX_CHARACTERS = 120
MAX_FILE_NAME_BYTES = 255  # of Linux, macOS and Windows; endings and temporary names included
MAX_DIGITS = 18  # of whole numbers in texts
MAX_NAMED = 20  # names in one message
MAX_OFFERED = 8  # of them, where there are more
TEMPORARY_BYTES = 20  # that a file being written adds to its name
FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r")  # of a cell that spreadsheets calculate
FOLDER_SEPARATORS = "/\\"
INVISIBLE_CATEGORIES = {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"}  # categories of Unicode
NAME_ALPHABET = (
    f"A name has 1 to {MAX_CHARACTERS} letters, digits, signs and spaces, no slash and no invisible"
    " character, and does not begin with a dot, a dash or a space."
)


def check_text(name: object, what: str, error: type[RomError] = ConfigError) -> str:
    """The name as read, if it is a text of one line that can be seen.

    Messages say what it names, e.g. "an interface".
    """
    if not isinstance(name, str) or not name.strip():
        raise error(f"the name of {what} must be a text that is not empty, got {name!r}.")
    if len(name) > MAX_CHARACTERS:
        raise error(
            f"the name {name[:20]!r}... of {what} has {len(name)} characters; at most "
            f"{MAX_CHARACTERS} are allowed."
        )
    if hidden := {c for c in name if unicodedata.category(c) in INVISIBLE_CATEGORIES}:
        codes = ", ".join(sorted(f"U+{ord(c):04X}" for c in hidden))
        raise error(
            f"the name {name!a} of {what} has characters that cannot be seen: {codes}.",
            hint=NAME_ALPHABET,
        )
    return name


def is_whole(text: str) -> bool:
    """Whether a text from outside is a whole number of at most 18 digits: it fits eight bytes."""
    return len(text) <= MAX_DIGITS and text.isascii() and text.isdecimal()


def check_name(name: object, what: str, error: type[RomError] = ConfigError) -> str:
    """The name, if a thing may be given it; arguments and errors as for `check_text`."""
    name = check_text(name, what, error)
    reason = ""
    if found := [c for c in FOLDER_SEPARATORS if c in name]:
        reason = f"contains {found[0]!r}, which would lead to another folder"
    elif name[0] in ".- " or name[-1] == " ":
        reason = f"begins with {name[0]!r}" if name[0] in ".- " else "ends with a space"
    if reason:
        raise error(f"the name {name!r} of {what} {reason}.", hint=NAME_ALPHABET)
    return name


def file_name(name: str, ending: str = "") -> str:
    """The name of a file for a thing of this name, in no folder, with an ending such as ".csv"."""
    found = f"{check_name(name, 'a file')}{ending}"
    size = len(found.encode()) + TEMPORARY_BYTES
    if size > MAX_FILE_NAME_BYTES:
        raise ConfigError(
            f"the file name {found[:20]!r}... takes {size} bytes while it is written; at most "
            f"{MAX_FILE_NAME_BYTES} are possible.",
            hint="Give the body a shorter name.",
        )
    return found


def check_ending(path: str | Path, what: str, *endings: str) -> Path:
    """The path, if it has one of the endings that such a file is written with, usual one first."""
    path = Path(path)
    if path.suffix.lower() not in endings:
        text = f"{path}: {what} is written as {', '.join(endings)}"
        raise ConfigError(f"{text}; write {path.stem or 'name'}{endings[0]}.")
    return path


def csv_cell(text: str) -> str:
    """A text in a table with commas, which no spreadsheet takes for a formula or two cells."""
    text = f"'{text}" if text.startswith(FORMULA_STARTS) else text
    return '"' + text.replace('"', '""') + '"' if any(c in text for c in ',"\r\n') else text


def inside(folder: str | Path, name: str, ending: str = "") -> Path:
    """Path of a file for a thing of this name, in a folder and nowhere else."""
    folder = Path(folder)
    path = folder / file_name(name, ending)
    if path.parent.resolve() != folder.resolve():
        raise ConfigError(f"{path} must lie within {folder}.")
    return path


def named(names: Iterable[object]) -> str:
    """All of the names in quotes, or numbers, with commas; beyond `MAX_NAMED` how many more."""
    words = [repr(name) for name in names]
    more = f" and {len(words) - MAX_NAMED} more" if len(words) > MAX_NAMED else ""
    return ", ".join(words[:MAX_NAMED]) + more


def offered(names: Iterable[object], wanted: object = "") -> str:
    """What there is instead of an unknown name: all names, or the most alike of many."""
    every = sorted(map(str, names))
    if len(every) <= MAX_NAMED:
        return str(every)
    near = get_close_matches(str(wanted), every, MAX_OFFERED, cutoff=0.0)
    return f"{near} and {len(every) - len(near)} more"


def check_once(names: Iterable[object], what: str, error: type[RomError] = ConfigError) -> None:
    """Refuse names that occur twice; arguments and errors as for `check_text`."""
    if twice := [name for name, n in Counter(names).items() if n > 1]:
        raise error(f"{what} {named(twice)} is given twice; use each once.")


Error = type[RomError]


def check_known(
    name: object, known: Iterable[object], text: str, error: Error = ConfigError
) -> None:
    """Refuse a name that is not among those known, in a text that goes on with a list of them."""
    if name not in known:
        raise error(f"{text} {offered(known, name)}.")


def check_all_known(
    names: Iterable[object], known: Iterable[object], text: str, error: Error = ConfigError
) -> None:
    """Refuse names that are not among those known, in a text that goes on with them."""
    known = list(known)
    if unknown := [name for name in names if name not in known]:
        raise error(f"{text} {named(unknown)}; there are {offered(known, unknown[0])}.")
