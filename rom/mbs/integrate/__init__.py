"""Time integration.

`simulation` is the entry and `run` the loop; `consistent_start` and `step_memory` begin;
`generalized_alpha`, `bdf`, `index2`, `dop853` and `radau_start` take steps, of `fixed_step` or
`adaptive_step`, whose length `step_control` chooses; `events` and `event_end` interrupt; `keeping`
saves what there is.
"""

from rom.lazy import front

front(__name__)
