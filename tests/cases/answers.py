"""What a verb prints with ``--json``."""

import json

from cases.files.schema import errors
from rom.cli.main import main
from rom.cli.schemas import schema


def answer(capsys, *words, codes=(0,)):
    """The object, which is what the schema of the verb says."""
    capsys.readouterr()
    assert main([*map(str, words), "--json"]) in codes
    found = json.loads(capsys.readouterr().out)
    assert errors(found, schema(str(words[0]))) == []
    return found
