"""Tables of calls that are refused, each a test."""

import pytest


def refused(*rows, error=None):
    """A test that each call is refused, by the class of the error and the name of the culprit.

    Rows are a call without arguments, the class unless it is that of all, what the message matches.
    """

    @pytest.mark.parametrize("row", rows)
    def test(row):
        call, *kind, words = row
        with pytest.raises(*kind or [error], match=words):
            call()

    return test


def refuses(error, words, call, *args, **keywords):
    """Assert that a call is refused, by the class of the error and what its message must match."""
    with pytest.raises(error, match=words):
        call(*args, **keywords)
