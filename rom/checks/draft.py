"""A reduction under way: what was asked for, what its stages have found, and how they are run."""

import logging
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from rom.body.projection import Elastic
from rom.eigen.connection import Connection
from rom.eigen.verbs import Operators
from rom.model import Array, Basis, Row
from rom.process.stopwatch import Stopwatch, stopwatch
from rom.reduction.full_model import mesh_operators, operators
from rom.reduction.interfaces.kinds import by_name
from rom.reduction.interfaces.order import open_orders

log = logging.getLogger("rom")
COMPARISON_STAGE = "comparison"  # of what certifies, which does not count as "seconds to reduce"
Stage = Callable[[Any], None]


@dataclass(kw_only=True)
class Draft:
    """What a reduction was asked for, and what each of its stages has found so far."""

    model: Any  # this and what follows as `rom.reduce` takes it
    method: Any = None
    interfaces: dict[str, Any] = field(default_factory=dict)
    reference: Any = "mean-axis"
    damping: Any = None
    name: str = "body"
    stress: bool = False
    stiffening: bool = False
    nonlinear: Any = None
    certify: Any = True
    open_orders: list[str] = field(init=False)  # interfaces whose polynomials have no order yet
    connection: Connection = field(init=False)  # the model in the coordinates of its interfaces
    maker: Any = field(init=False)  # the method that makes the basis there
    basis: Basis = field(init=False)  # its shapes in these coordinates
    Psi: Array = field(init=False)  # (n_local, 6 + r) the same in nodal dofs
    elastic: Elastic = field(init=False)  # the part of it without rigid motion
    E: Array = field(init=False)  # (n_local, r) shapes of the body in nodal dofs
    rows: tuple[Row, ...] = ()  # further lines for the certificate of the body
    body: Any = field(init=False)  # what the reduction gives
    # of the time of the stages, which begin a heading of it or count to that before
    watch: Stopwatch = field(default_factory=Stopwatch)

    def __post_init__(self) -> None:
        self.interfaces = by_name(self.interfaces)
        self.open_orders = open_orders(self.interfaces)

    @cached_property
    def bare(self) -> Operators:
        """Operators of the mesh alone, in nodal dofs."""
        return mesh_operators(self.model)

    @cached_property
    def ops(self) -> Operators:
        """Operators of the model with all it carries, in nodal dofs."""
        return operators(self.model)

    def say(self, message: str, *numbers: int) -> None:
        """Tell what is done, aloud on one process only."""
        log.log(logging.INFO if self.ops.first == 0 else logging.DEBUG, message, *numbers)

    @property
    def seconds(self) -> float:
        """Time of all stages but those that compare with the full model [s]."""
        table = self.watch.table()
        return round(sum(table[name]["seconds"] for name in table if name != COMPARISON_STAGE), 3)


def run(stages: Iterable[Stage], draft: Draft) -> Any:
    """Do the stages of a reduction one after the other, and time them; the body of the draft.

    Stages are functions of the draft, such as `rom.workflow.stages` lists, or your own.
    """
    with stopwatch() as draft.watch:
        for stage in stages:
            stage(draft)
    return draft.body


def wanted(*table: tuple[Any, Stage]) -> list[Stage]:
    """The stages of a table in whose front a condition holds."""
    return [stage for condition, stage in table if condition]
