"""The spectral density of a rectifier's charge is that of the runs, not of the quantile of its error."""

import numpy as np
import pytest

from harvester.storage.held_stores import Gained
from harvester.storage.measured_current import Rung, table_of


@pytest.mark.statistics
@pytest.mark.parametrize("together", [1, 64])
def test_density_is_the_variance_of_the_charge_per_time(together):
    """Charges of one run with the variance 1 in 4 s have the density 0.25; records of 64 runs share theirs."""
    rng = np.random.default_rng(together)
    rungs = []
    for _ in range(200):
        charges = 5.0 + rng.standard_normal(256)
        gained = Gained(charges, np.ones(256), 4.0)
        rungs.append(Rung(settles=charges, seconds=1.0, counted=gained))
    table = table_of(np.arange(200.0), rungs, False, together)
    expected = 0.25
    error = table.density.std(ddof=1) / np.sqrt(200)
    assert abs(table.density.mean() - expected) < 4.0 * error
    if together > 1:  # Student's quantile of 4 records is in the stated error alone
        assert (table.stderr**2 * 256 * 4.0).mean() > 2.0 * table.density.mean()
