"""Local maxima in windows, against loops over places that are written out."""

import numpy as np
import pytest

from nearfar.correspondence.levels import MISSED_DEVIATIONS, MISSED_SHARE
from nearfar.correspondence.maxima import local_maxima

PROJECTOR = (12, 15)


def written_out(scores, deviations, place, down, across):
    """Return (place, score) of the maxima about one candidate, row by row."""
    window = {}
    for i, y in enumerate(place[0] + down):
        for j, x in enumerate(place[1] + across):
            if 0 <= y < PROJECTOR[0] and 0 <= x < PROJECTOR[1]:
                window[i, j] = max(scores[:, i, j] / deviations)
    highest = max(window.values())
    least = highest - MISSED_SHARE * abs(highest) - MISSED_DEVIATIONS
    found = []
    for (i, j), score in window.items():
        about = [window.get((i + a, j + b), -np.inf) for a in (-1, 0, 1) for b in (-1, 0, 1)]
        if score >= max(about) and score >= least:
            found.append(((place[0] + down[i], place[1] + across[j]), score))
    return found


@pytest.mark.parametrize(
    ("widths", "down", "across", "anywhere"),
    [
        (3, [-4, -2, 0, 2, 4], [-3, 0, 3], True),
        (1, np.arange(12), np.arange(0, 15, 2), False),
        (2, [0], [0], True),
    ],
    ids=["about candidates", "the whole projector", "one place"],
)
def test_maxima_are_those_of_loops_over_places(widths, down, across, anywhere):
    generator = np.random.default_rng(0)
    down, across = np.asarray(down), np.asarray(across)
    shape = (200, widths, len(down), len(across))
    # Whole numbers, so that neighbours often score alike.
    scores = generator.integers(-20, 40, shape).astype(np.float32)
    deviations = np.float32(2.0) ** generator.integers(-1, 2, (200, widths))
    places = generator.integers(0, PROJECTOR, (200, 2)) if anywhere else np.zeros((200, 2), int)
    which, place, score = local_maxima(
        scores,
        deviations,
        places,
        down,
        across,
        np.array(PROJECTOR),
        (MISSED_SHARE, MISSED_DEVIATIONS),
    )
    expected = [
        (m, *found)
        for m in range(200)
        for found in written_out(scores[m], deviations[m], places[m], down, across)
    ]
    assert which.tolist() == [m for m, _, _ in expected]
    assert [tuple(one) for one in place] == [one for _, one, _ in expected]
    assert score.tolist() == [one for _, _, one in expected]
