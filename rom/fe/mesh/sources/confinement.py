"""What the process that reads a foreign geometry can no longer do, whatever the geometry says.

On Linux it starts no process and opens no connection (seccomp), and writes nowhere but in its own
folder and runs no program (Landlock, from kernel 5.13 on). The text of a script is looked at
before, see `rom.fe.mesh.sources.script`; this is for what the text does not show. Neither needs a
privilege.
"""

import ctypes
import os
import platform
import struct
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

PR_SET_NO_NEW_PRIVS, PR_SET_SECCOMP, SECCOMP_MODE_FILTER = 38, 22, 2
LOAD, EQUAL, SET, ABOVE, RETURN = 0x20, 0x15, 0x45, 0x35, 0x06  # codes of the Berkeley filter
ALLOW, KILL = 0x7FFF0000, 0x80000000
ENOSYS, EACCES = 0x00050026, 0x0005000D  # fail with this error
NUMBER, MACHINE, FIRST = 0, 4, 16  # where the filter finds call, machine and first argument
CLONE_THREAD = 0x00010000
OTHER_NUMBERING = 0x40000000  # calls of x32 on x86_64
LANDLOCK_CREATE, LANDLOCK_ADD, LANDLOCK_RESTRICT = 444, 445, 446
PATH_BENEATH = 1
# execute; write, remove and make files of all kinds; by the version that brought them
RIGHTS = {1: 0b1_1111_1111_0011, 2: 1 << 13, 3: 1 << 14}
EXECUTE, TRUNCATE, WRITE_FILE = 1, 1 << 14, 2


class Calls(NamedTuple):
    """Machine, as the kernel numbers it, and numbers of its system calls."""

    machine: int
    clone: int
    clone3: int
    socket: int
    starters: tuple[int, ...]  # fork, vfork, execve, execveat


CALLS = {
    "x86_64": Calls(0xC000003E, 56, 435, 41, (57, 58, 59, 322)),
    "aarch64": Calls(0xC00000B7, 220, 435, 198, (221, 281)),
}


def confine(folder: Path) -> None:
    """Confine this process to a folder, once all it needs is loaded; threads still work.

    Where the system offers neither way nothing happens.
    """
    if not sys.platform.startswith("linux"):
        return
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0):
        return
    _write_only_below(libc, folder)
    calls = CALLS.get(platform.machine())
    if calls is not None:
        _install(libc, _filter(calls))


def _filter(calls: Calls) -> list[tuple[int, int, int, int]]:
    """A process that tries to start another is killed by SIGSYS, which its parent can tell."""
    return [
        (LOAD, 0, 0, MACHINE),
        (EQUAL, 1, 0, calls.machine),
        (RETURN, 0, 0, KILL),
        (LOAD, 0, 0, NUMBER),
        *_answer(ABOVE, [OTHER_NUMBERING], KILL),
        *_answer(EQUAL, calls.starters, KILL),
        *_answer(EQUAL, [calls.socket], EACCES),
        *_answer(EQUAL, [calls.clone3], ENOSYS),  # whose flags no filter sees; clone follows
        (EQUAL, 0, 3, calls.clone),
        (LOAD, 0, 0, FIRST),
        (SET, 1, 0, CLONE_THREAD),
        (RETURN, 0, 0, KILL),
        (RETURN, 0, 0, ALLOW),
    ]


def _answer(test: int, values: Iterable[int], verdict: int) -> list[tuple[int, int, int, int]]:
    steps = [[(test, 0, 1, value), (RETURN, 0, 0, verdict)] for value in values]
    return [step for pair in steps for step in pair]


def _install(libc: ctypes.CDLL, steps: list[tuple[int, int, int, int]]) -> None:
    code = b"".join(struct.pack("=HBBI", *step) for step in steps)
    buffer = ctypes.create_string_buffer(code)
    program = struct.pack("@HP", len(steps), ctypes.addressof(buffer))
    libc.prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, program, 0, 0)


def _write_only_below(libc: ctypes.CDLL, folder: Path) -> None:
    version = libc.syscall(LANDLOCK_CREATE, None, 0, 1)
    rights = sum(right for since, right in RIGHTS.items() if since <= version)
    if not rights:
        return
    rules = libc.syscall(LANDLOCK_CREATE, struct.pack("=Q", rights), 8, 0)
    if rules < 0:
        return
    _allow(libc, rules, folder, rights & ~EXECUTE)
    _allow(libc, rules, Path(os.devnull), rights & (WRITE_FILE | TRUNCATE))
    libc.syscall(LANDLOCK_RESTRICT, rules, 0)
    os.close(rules)


def _allow(libc: ctypes.CDLL, rules: int, path: Path, rights: int) -> None:
    place = os.open(path, os.O_PATH)
    libc.syscall(LANDLOCK_ADD, rules, PATH_BENEATH, struct.pack("=Qi", rights, place), 0)
    os.close(place)
