"""The one class of bodies: what is made of one is one again."""

import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

import rom
from cases.beam import stiffened_beam


def test_what_is_made_of_a_body_is_a_flexible_body():
    body = stiffened_beam(n_modes=6)
    for made in (body.in_units("mm-t-s"), body.with_reference("tip"), replace(body, name="other"),
                 pickle.loads(pickle.dumps(body))):  # fmt: skip
        assert type(made) is rom.FlexibleBody and repr(made).startswith("FlexibleBody(")
        frequencies = (one.frequencies(3, fixed=("root",)) for one in (made, body))
        np.testing.assert_allclose(*frequencies, rtol=1e-9)


@pytest.mark.parametrize("name", ["mass", "remark"])
def test_nothing_is_set_on_a_body(name):
    """Neither a field nor anything else."""
    with pytest.raises(FrozenInstanceError):
        setattr(stiffened_beam(n_modes=6), name, 1.0)
