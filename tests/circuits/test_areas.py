"""A junction of twice the area is two in parallel: currents, resistances and stored charges grow alike."""

import numpy as np
import pytest

from harvester.equations.problem import Problem
from tests.support.netlists import compiled, on_plate

LOAD = "Rload p n 500k\nRs p c 20k\n"
BIPOLAR = "Rb p b 200k\n.model kind NPN(Is=1f BF=80 CJE=10n CJC=20n TF=1u RE=10 RC=20 RB=50)\n"
DIODE = ".model kind D(Is=1n N=1.2 Cjo=20n M=0.4 Rs=100 Tt=1u)\n"
PAIRS = {
    "diode": (DIODE + "D1 c n kind {area}", DIODE + "D1 c n kind\nD2 c n kind"),
    "bipolar": (BIPOLAR + "Q1 c b n kind {area}", BIPOLAR + "Q1 c b n kind\nQ2 c b n kind"),
}


def path(folder, name, body):
    """The voltage of the piezo along a trajectory of the plate."""
    scene = on_plate(folder, LOAD + body, name)
    noise = np.random.default_rng(0).normal(size=300)
    return compiled(scene).trace(Problem(scene).equations, noise, 0.05).V


@pytest.mark.slow
@pytest.mark.parametrize("kind", PAIRS)
def test_twice_the_area_is_two_in_parallel(tmp_path, kind):
    """To the tolerance of the steps; a third of the area is not, so that the parts matter here."""
    wide, both = PAIRS[kind]
    one = path(tmp_path, "wide", wide.format(area=2))
    two = path(tmp_path, "both", both)
    small = path(tmp_path, "small", wide.format(area=0.3))
    size = np.abs(two).max()
    assert np.abs(one - two).max() < 1e-3 * size
    assert np.abs(small - two).max() > 3e-2 * size
