"""The judgement of all predicted numbers together: the bounds of any width, the counts, and the page."""

import importlib
import itertools
import math
import re
import sys

import numpy as np
import pytest

from tests.support.paths import ROOT

sys.path.append(str(ROOT / "benchmarks"))
judged = importlib.import_module("priors_judged")


def test_the_bound_is_that_of_every_choice_of_narrow_intervals():
    """All halves of made-up numbers that could be narrow, all others wide: the best of them is the bound."""
    rng = np.random.default_rng(0)
    for count in (5, 6, 9):
        off = list(rng.normal(0.0, 0.8, count))
        best = 0
        for narrow in itertools.combinations(range(count), (count + 1) // 2):
            widths = [3.0 if at in narrow else 1e9 for at in range(count)]
            held = sum(judged.held_by([x], wide) for x, wide in zip(off, widths, strict=True))
            assert np.median(widths) == 3.0 or count % 2 == 0
            best = max(best, held)
        assert judged.most_held(off, 3.0) == best


def test_the_least_width_holds_its_share_and_a_narrower_one_does_not():
    off = [0.1, -0.2, 0.3, -0.4, 0.5, -0.6, 0.7, -0.8, 0.9, -2.0]
    least = judged.least_width(off, 0.9)
    assert least == pytest.approx(math.exp(1.8))
    assert judged.held_by(off, least * 1.001) == 9 and judged.held_by(off, least * 0.999) == 8


def test_numbers_of_no_fit_keep_their_prediction():
    """A voltage counts as a power, and a displacement has no width."""
    found = list(judged.unfitted())
    assert sum(one.device == "D26" for one in found) == 6
    assert [one.width for one in found if one.device == "D14"].count(None) == 1
    [row] = [x for x in judged.unseen_cantilevers.judged(["D13"]) if x.unit == "V"]
    [_, volts] = [one for one in found if one.device == "D13"]
    assert volts.width == pytest.approx((row.high / row.low) ** 2)
    assert volts.off == pytest.approx(2.0 * math.log(float(row.measured) / row.predicted))


@pytest.mark.slow
def test_the_page_has_the_judgement_of_all():
    """Its tables are those that the command prints now."""
    page = judged.PAGE.read_text().partition(judged.BEGIN)[2].partition(judged.END)[0]
    assert page.strip().splitlines() == judged.block()


def test_the_first_page_has_the_coverage():
    """README's row on real devices is that of the table."""
    row = r"\| all \| (\d+) \| (\d+ of (\d+)) \|.*?\| (\d+) \|"
    devices, held, count, width = re.search(row, judged.PAGE.read_text()).groups()
    readme = (ROOT / "README.md").read_text()
    assert f"{count} quantities of {devices} published devices" in readme
    assert f"{held} inside the 95 % interval, whose ends differ by a factor of {width} " in readme
