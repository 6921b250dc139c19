"""The one class of bodies: what is made of one is one again."""

import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

import rom
from cases.beam import stiffened_beam

MADE = {
    "in other units": lambda body: body.in_units("mm-t-s"),
    "in another frame": lambda body: body.with_reference("tip"),
    "with another name": lambda body: replace(body, name="other"),
    "from a pickle": lambda body: pickle.loads(pickle.dumps(body)),
}


@pytest.mark.parametrize("way", MADE)
def test_what_is_made_of_a_body_is_a_flexible_body(way):
    body = stiffened_beam(n_modes=6)
    made = MADE[way](body)
    assert type(made) is rom.FlexibleBody and repr(made).startswith("FlexibleBody(")
    np.testing.assert_allclose(made.frequencies(3, fixed=("root",)),
                               body.frequencies(3, fixed=("root",)), rtol=1e-9)  # fmt: skip


@pytest.mark.parametrize("name", ["mass", "remark"])
def test_nothing_is_set_on_a_body(name):
    """Neither a field nor anything else."""
    with pytest.raises(FrozenInstanceError):
        setattr(stiffened_beam(n_modes=6), name, 1.0)
