"""What a modal file of MBDyn says."""

import re

import numpy as np


def groups(path):
    """{number: words} of the record groups; lines with two stars are comments."""
    found = {}
    for part in re.split(r"^\*\* RECORD GROUP ", path.read_text(), flags=re.M)[1:]:
        head, *lines = part.splitlines()
        words = [word for line in lines if not line.startswith("**") for word in line.split()]
        found[int(head.split(",")[0])] = words
    return found


def numbers(words, *shape):
    return np.array(words, dtype=float).reshape(shape)
