"""Decks are read card by card: all of what they mean, or refused by the name of the card.

Random decks of a box are compared with its volume, centre and end face in closed form.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cases.files.random_decks import SIZE, random_deck
from cases.long import few
from rom.errors import FileFormatError
from rom.fe.mesh.sources import abaqus, nastran

READERS = {"bdf": nastran.read, "inp": abaqus.read}
# corners of the six tetrahedra of a brick around its diagonal from 0 to 6
DIAGONAL = ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))


def volume_and_centre(points, cells):
    """Of straight cells, summed over tetrahedra."""
    parts = [cells[:, :4]]
    if cells.shape[1] in (8, 20):
        parts = [cells[:, [0, a, b, 6]] for a, b in DIAGONAL]
    x = points[np.vstack(parts)]
    v = np.abs(np.linalg.det(x[:, 1:] - x[:, :1])) / 6
    return v.sum(), (v[:, None] * x.mean(axis=1)).sum(axis=0) / v.sum()


CASES = [(form, seed) for seed in range(30) for form in ("bdf", "inp")]


@pytest.mark.parametrize(("form", "seed"), few(14, CASES))
def test_random_decks_are_read_whole_or_refused_by_card(form, seed, tmp_path):
    deck = random_deck(seed, form)
    for name, text in deck.files.items():
        (tmp_path / name).write_text(text)
    path = str(tmp_path / f"deck.{form}")
    if deck.refused:
        with pytest.raises(FileFormatError) as caught:
            READERS[form](path)
        assert f"{deck.refused} (1, deck.{form} line " in str(caught.value)
        return
    arrays, notes = READERS[form](path)
    local = (arrays["points"] - deck.origin) @ deck.turn
    assert notes["cell_type"] == deck.kind and len(arrays["cells"]) == deck.n_cells
    rtol = 10.0 ** (3 - deck.digits)
    volume, centre = volume_and_centre(local, arrays["cells"])
    assert volume == pytest.approx(np.prod(SIZE), rel=30 * rtol)
    assert_allclose(centre, np.array(SIZE) / 2, atol=rtol)
    (root,) = (arrays[f"facets {k}"] for k, name in enumerate(notes["facet_names"])
               if name.upper() in ("SPC_7", "ROOT"))  # fmt: skip
    assert_allclose(local[root, 0], 0.0, atol=rtol)
