"""Values at even spaces: as many as asked for, both ends among them, the same step from each to the next."""

import numpy as np
import pytest

import harvester as hv
from harvester.quantities.units import seconds

COUNTS = [2, 3, 4, 7, 50]


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("ends", [(0.0, 1.0), (-3.0, 0.5), (2.0, 1e-3)])
def test_even_steps(ends, count):
    """A value left out, or all of them apart by another step than the last."""
    values = np.array(hv.linspace(*ends, count))
    assert len(values) == count and (values[0], values[-1]) == ends
    assert np.diff(values) == pytest.approx(np.full(count - 1, (ends[1] - ends[0]) / (count - 1)))


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("ends", [(1.0, 100.0), (2e3, 1e-3)])
def test_even_ratios(ends, count):
    """The same of the logarithms."""
    values = np.array(hv.logspace(*ends, count))
    assert len(values) == count and (values[0], values[-1]) == ends
    assert np.diff(np.log(values)) == pytest.approx(
        np.full(count - 1, np.log(ends[1] / ends[0]) / (count - 1))
    )


@pytest.mark.parametrize("make", [hv.linspace, hv.logspace])
def test_texts_are_the_numbers_with_a_unit(make):
    """In the unit of the first, whatever the prefix of the last."""
    numbers = [float(text.removesuffix(" kohm")) for text in make("1 kohm", "1 Mohm", 5)]
    assert numbers == pytest.approx(make(1.0, 1000.0, 5), rel=1e-14)


@pytest.mark.parametrize("number", ["1", "0.5", ".25", "90"])
def test_a_minute_has_sixty_seconds_and_an_hour_sixty_minutes(number):
    """A time without a unit is in seconds."""
    assert seconds(f"{number} s") == seconds(number) == float(number)
    assert seconds(f"{number}min") == 60.0 * seconds(number)
    assert seconds(f" {number} h") == 60.0 * seconds(f"{number}min")
