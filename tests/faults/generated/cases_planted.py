"""Mistakes planted on purpose, to see whether the judge finds them; they count in no figure."""

import os
import time

from generated.case import Silent, Works, case, require
from rom.errors import ConfigError, MeshError


def endless(folder):
    while True:
        time.sleep(0.01)


def foreign(folder):
    raise ValueError("not one of ours")


def leaving(folder):
    (folder / "half").write_text("")
    raise ConfigError("no such option: --lc.")


def outside(folder):
    (folder.parent / "elsewhere").write_text("")


def refused(folder):
    raise ConfigError("no such option: --lc.")


CASES = [
    case("a crash", lambda folder: os.abort(), Works),
    case("an exit", lambda folder: os._exit(0), Works),
    case("a hang", endless, Works, seconds=0.5),
    case("another exception", foreign, (Works, ConfigError)),
    case("a file that is left", leaving, ConfigError),
    case("a file elsewhere", outside, Works),
    case("another class", refused, MeshError),
    case("another word", refused, ConfigError, "--hex"),
    case("no warning", refused, Silent),
    case("a wrong value", lambda folder: require(False, "2 instead of 3"), Works),
    case("nothing wrong", refused, ConfigError, "--lc"),
]
