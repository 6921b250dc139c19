"""How much memory there is, how much of it this process may still take, and what it has mapped."""

import os
import resource
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from rom.errors import ResourceError

NO_LIMIT = 1 << 60
CONTROL_GROUPS = Path("/sys/fs/cgroup")
GROUP_FILES = (  # limit, use, and the line of memory.stat with what is given back when asked for
    ("memory.max", "memory.current", "file"),
    ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_cache"),
)


def total_bytes() -> int:
    """Memory of this machine, or of the control group this process belongs to [bytes]."""
    total = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    with suppress(OSError, ValueError):  # "max", or no such file
        total = min(total, int((CONTROL_GROUPS / "memory.max").read_text()))
    return total


def free_bytes() -> float:
    """Memory this process may still take [bytes]."""
    return min(machine_free_bytes(), *map(group_bytes, _groups()), address_bytes())


def check_memory(what: str, need: float, there: float, hint: str) -> None:
    """Refuse what takes more memory than there is [bytes], in a text that begins with it."""
    if need > there:
        text = f"{what} takes {need / 2**30:.4g} GiB; {there / 2**30:.3g} GiB are free."
        raise ResourceError(text, hint=hint)


def peak_bytes() -> int:
    """Largest memory of this process so far [bytes]; Linux counts in units of 1024."""
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def mapped_files() -> list[str]:
    """Shared libraries this process has loaded; empty where the system does not tell."""
    return sorted({line.split()[-1] for line in _lines("/proc/self/maps") if ".so" in line})


def _lines(file: str) -> list[str]:
    try:
        return Path(file).read_text().splitlines()
    except OSError:
        return []


def machine_free_bytes() -> float:
    """What the machine has free; where it does not tell, no limit."""
    fields = dict(line.split(":", 1) for line in _lines("/proc/meminfo"))
    return 1024.0 * float(fields["MemAvailable"].split()[0]) if fields else float(NO_LIMIT)


def address_bytes() -> float:
    """What the limit on address space leaves."""
    limit, _ = resource.getrlimit(resource.RLIMIT_AS)
    if limit == resource.RLIM_INFINITY:
        return float(NO_LIMIT)
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    return float(limit - pages * os.sysconf("SC_PAGE_SIZE"))


def group_bytes(folder: Path) -> float:
    """What a control group of either version leaves; cached files count as free."""
    for limit, use, cache in GROUP_FILES:
        try:
            text = (folder / limit).read_text().strip()
            used = float((folder / use).read_text())
            pairs = (line.split() for line in (folder / "memory.stat").read_text().splitlines())
            cached = float(dict(pairs).get(cache, 0))
        except (OSError, ValueError):
            continue
        return float(NO_LIMIT) if text == "max" else max(float(text) - used + cached, 0.0)
    return float(NO_LIMIT)


def _groups() -> Iterator[Path]:
    """Folders of the control groups of this process, and of those around them."""
    yield from (CONTROL_GROUPS, CONTROL_GROUPS / "memory")
    for line in _lines("/proc/self/cgroup"):
        _, controllers, path = line.split(":", 2)
        root = CONTROL_GROUPS / ("memory" if controllers == "memory" else "")
        if controllers in ("", "memory"):
            own = root / path.strip("/")
            yield from (own, *(above for above in own.parents if above.is_relative_to(root)))
