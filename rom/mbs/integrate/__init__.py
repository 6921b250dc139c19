"""Time integration.

`simulation` is the entry and `run` the loop; `consistent_start` and `step_memory` begin;
`generalized_alpha`, `bdf`, `index2` and `dop853` take steps, of `fixed_step` or `adaptive_step`,
whose length `step_control` chooses; `events` interrupt; `keeping` saves what there is.
"""

from rom.lazy import front

front(__name__)
