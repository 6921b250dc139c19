"""A small checker of JSON Schemas, of the words that ours use and no others."""

import json

from rom.cli.main import main
from rom.cli.schemas import schema as schema_of

TYPES = {
    "string": lambda x: isinstance(x, str),
    "number": lambda x: isinstance(x, int | float) and not isinstance(x, bool),
    "integer": lambda x: isinstance(x, int) and not isinstance(x, bool),
    "boolean": lambda x: isinstance(x, bool),
    "null": lambda x: x is None,
    "array": lambda x: isinstance(x, list),
    "object": lambda x: isinstance(x, dict),
}
WORDS = {"type", "properties", "required", "additionalProperties", "items", "anyOf", "enum",
         "const", "description", "title", "$schema"}  # fmt: skip


def errors(value, schema, at="$"):
    """What is wrong with a value, as texts."""
    assert set(schema) <= WORDS, set(schema) - WORDS
    found = []
    types = schema.get("type", [])
    types = [types] if isinstance(types, str) else types
    if types and not any(TYPES[t](value) for t in types):
        return [f"{at} = {value!r} is no {' or '.join(types)}"]
    if "const" in schema and value != schema["const"]:
        found.append(f"{at} = {value!r} is not {schema['const']!r}")
    if "enum" in schema and value not in schema["enum"]:
        found.append(f"{at} = {value!r} is none of {schema['enum']}")
    if "anyOf" in schema:
        trials = [errors(value, one, at) for one in schema["anyOf"]]
        found += [] if [] in trials else min(trials, key=len)
    if isinstance(value, list) and "items" in schema:
        for k, item in enumerate(value):
            found += errors(item, schema["items"], f"{at}[{k}]")
    if isinstance(value, dict):
        found += of_object(value, schema, at)
    return found


def of_object(value, schema, at):
    known, rest = schema.get("properties", {}), schema.get("additionalProperties", {})
    found = [f"{at} lacks {name!r}" for name in schema.get("required", ()) if name not in value]
    for name, item in value.items():
        if name in known:
            found += errors(item, known[name], f"{at}.{name}")
        elif rest is False:
            found.append(f"{at} has {name!r} too much")
        else:
            found += errors(item, rest, f"{at}.{name}")
    return found


def answer(capsys, *words, codes=(0,)):
    """The object that a verb prints with ``--json``, which is what its schema says."""
    capsys.readouterr()
    assert main([*map(str, words), "--json"]) in codes
    found = json.loads(capsys.readouterr().out)
    assert errors(found, schema_of(str(words[0]))) == []
    return found
