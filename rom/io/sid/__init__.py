"""Standard Input Data of flexible bodies.

`format` is the record and its text, `dialect` what programs do differently, `reading` parses,
`body` goes between a record and a flexible body.
"""

from rom.lazy import front

front(__name__)
