"""Operations of constants: a table at a place is that of numpy, and continues with its last slopes."""

import numpy as np
import pytest

from harvester.netlists.folding import piecewise

KNOTS = np.array([-2.0, -0.5, 0.25, 1.0, 4.0])
VALUES = np.array([3.0, -1.0, 0.5, 0.5, 7.0])
TABLE = np.column_stack([KNOTS, VALUES]).ravel()


@pytest.mark.parametrize("x", [*np.linspace(-2.0, 4.0, 25), *KNOTS])
def test_a_table_is_piecewise_linear(x):
    assert piecewise(x, *TABLE) == pytest.approx(np.interp(x, KNOTS, VALUES), abs=1e-12)


@pytest.mark.parametrize(("x", "end"), [(-5.0, 0), (11.0, -1)])
def test_a_table_continues_with_its_last_slopes(x, end):
    slope = (np.diff(VALUES) / np.diff(KNOTS))[end]
    assert piecewise(x, *TABLE) == pytest.approx(VALUES[end] + slope * (x - KNOTS[end]))
