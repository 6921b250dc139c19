"""How much memory a factorisation will take, asked before it is taken."""

from pathlib import Path

from rom.errors import ResourceError

SHARE = 0.85  # of the memory that is free
UNLIMITED = 1 << 60  # cgroups write their "no limit" as a number of this size or as "max"


def factor_bytes(n: int) -> float:
    """Predicted memory of a sparse factor of quadratic tetrahedra [bytes].

    A power law through measured MUMPS factors of blocks with 16 731 to 224 547 dofs: 71 MB times
    (n / 16 700)^1.37.
    """
    return 71e6 * (n / 16_700) ** 1.37


def free_bytes() -> float:
    """Memory this process may still take [bytes]: the machine's, or the control group's if less."""
    lines = Path("/proc/meminfo").read_text().splitlines()
    fields = dict(line.split(":", 1) for line in lines)
    machine = 1024.0 * float(fields["MemAvailable"].split()[0])
    group = Path("/sys/fs/cgroup")
    limit, used = (_number(group / name) for name in ("memory.max", "memory.current"))
    return machine if limit >= UNLIMITED else min(machine, limit - min(used, limit))


def check_factor_memory(n: int, n_columns: int = 0) -> None:
    """Refuse a factorisation that would not fit.

    Args:
        n: number of dofs to factor.
        n_columns: dense columns of that length that are kept beside the factor.

    Raises:
        ResourceError: with the need and what there is.
    """
    need, there = factor_bytes(n) + 8.0 * n * n_columns, free_bytes()
    if need > SHARE * there:
        raise ResourceError(
            f"factoring {n} dofs is predicted to take {need / 2**30:.1f} GiB; "
            f"{there / 2**30:.1f} GiB are free, of which {SHARE:.0%} may be used.",
            hint="Use a coarser mesh, more machines, or a machine with more memory.",
        )


def _number(path: Path) -> float:
    try:
        text = path.read_text().strip()
    except OSError:
        return float(UNLIMITED)
    return float(UNLIMITED) if text == "max" else float(text)
