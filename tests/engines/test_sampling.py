"""Whether trajectories under a steady excitation agree: by the voltage, and by the parts of the power."""

from types import SimpleNamespace

import numpy as np
import pytest

from harvester.answers.estimate import SteadyResponse
from harvester.engines.sampling import agreement
from harvester.uncertainty.value import Value


@pytest.mark.parametrize(
    ("v2", "load", "said"),
    [
        ((1.0, 1.0), (2.0, 2.0), "no sampling error: nothing is random"),
        ((1.0, 1.01), (2.0, 2.0), None),
        (
            (1.0, 1.2),
            (2.0, 2.0),
            "trajectories differ in E[V^2], from 0.909 to 1.09 times the mean",
        ),
        (
            (1.0, 1.0),
            (2.0, 3.0),
            "trajectories differ in the load's power, from 0.8 to 1.2 times the mean",
        ),
        ((0.0, 0.0), (0.0, 0.0), "no sampling error: nothing is random"),
    ],
)
def test_the_larger_difference_counts(v2, load, said):
    """A capacitor that still charges has a power that differs long after the voltage of the piezo is alike."""
    found = agreement(SimpleNamespace(V2=np.array(v2), load=np.array(load)), "load")
    assert found is None if said is None else str(found).startswith(said)


@pytest.mark.parametrize(("periods", "warned"), [((1,), False), ((0,), True), ((1, 1), True)])
def test_starts_that_are_known_to_come_to_one_response_agree(periods, warned):
    """They differ by the places of impacts and switchings in a step; not so a response that never comes back."""
    moments = SimpleNamespace(V2=np.array([1.0, 1.2]), load=np.array([1.0, 1.0]))
    responses = tuple(
        SteadyResponse(Value(1.0), 1.0 / len(periods), one, False, "ideal") for one in periods
    )
    assert (agreement(moments, "load", responses) is not None) == warned
