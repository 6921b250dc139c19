"""Tables of calls that are refused, each a test."""

import pytest


def refused(*rows, error=None):
    """A test that each call is refused, by the class of the error and the name of the culprit.

    Args:
        rows: a call without arguments, the class, and what the message must match.
        error: the class, where rows leave it out.
    """

    @pytest.mark.parametrize("row", rows)
    def test(row):
        call, *kind, words = row
        with pytest.raises(*kind or [error], match=words):
            call()

    return test


def refuses(error, says, call, *given, **named):
    """The call is refused by the class of the error, and what its message matches."""
    with pytest.raises(error, match=says):
        call(*given, **named)
