"""One mode is the modes of a single coordinate: the numbers of both are the same."""

import numpy as np
import pytest

from harvester.equations.modes import Modes, SingleMode

ALONE = Modes(stiffness=(0.0,), damping=(0.0,), coupling=(1.0,), base=(1.0,), contact=(1.0,))


@pytest.mark.parametrize("mu", [None, 0.5])
def test_the_flow_of_a_single_coordinate(mu):
    numbers = {"beta": 0.3, "grown": 1.0, "mu": mu}
    np.testing.assert_array_equal(
        SingleMode().flow(1.2, 0.1, **numbers), ALONE.flow(1.2, 0.1, **numbers)
    )


@pytest.mark.parametrize("name", ["shaken_mass", "meets_stops", "pull"])
def test_the_properties_of_a_single_coordinate(name):
    assert getattr(SingleMode(), name) == getattr(ALONE, name)
