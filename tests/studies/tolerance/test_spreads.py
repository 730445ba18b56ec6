"""Spreads as they are written, against the distributions that they name; E series against the standard."""

import numpy as np
import pytest
from scipy import stats

import harvester as hv
from harvester.quantities import preferred_numbers as preferred
from harvester.studies.tolerance import design
from harvester.studies.tolerance.spreads import CUT, parse, spreads
from tests.support.paths import ROOT

PLATE = hv.load(ROOT / "examples" / "plate_with_stop.toml")
PLACES = np.linspace(0.001, 0.999, 997)


@pytest.mark.parametrize(
    ("written", "law"),
    [
        ("10%", stats.uniform(0.9e6, 0.2e6)),
        ("800k:1.1M", stats.uniform(0.8e6, 0.3e6)),
        ("normal:2%", stats.truncnorm(-CUT, CUT, 1e6, 2e4)),
        ("normal:1 Mohm:50k", stats.truncnorm(-CUT, CUT, 1e6, 5e4)),
        ("triangular:10%", stats.triang(0.5, 0.9e6, 0.2e6)),
        ("triangular:800k:1M:1.1M", stats.triang(2.0 / 3.0, 0.8e6, 0.3e6)),
        ("E24:5%", stats.uniform(0.95e6, 0.1e6)),
    ],
)
def test_spread_is_the_inverse_of_its_distribution(written, law):
    """SciPy's own distributions, which have another code, give the same values."""
    found = parse(f"load.resistance={written}", PLATE).at(PLACES)
    np.testing.assert_allclose(found, law.ppf(PLACES), rtol=1e-9)


def test_measured_values_are_each_as_likely():
    spread = parse("load.resistance=1M,1.1M,900k,1M", PLATE)
    values, counts = np.unique(spread.at(np.arange(0.0005, 1.0, 0.001)), return_counts=True)
    assert (values.tolist(), counts.tolist()) == ([9e5, 1e6, 1.1e6], [250, 500, 250])


def test_series_of_a_resistance_that_is_none_of_its_values():
    """1.04 Mohm is made as 1 Mohm in E12, 5 % about that."""
    assert parse("load.resistance=E12:5%", PLATE.with_load(1.04e6)).ends == pytest.approx(
        (0.95e6, 1.05e6)
    )


def test_key_without_its_table():
    assert parse("resistance=5%", PLATE).key == "load.resistance"


def test_preferred_values():
    """Values of IEC 60063 that a formula alone gets wrong, and how many each series has."""
    assert preferred.mantissas("E3") == (1.0, 2.2, 4.7)
    assert {2.7, 3.0, 3.3, 3.6, 3.9, 4.3, 4.7, 8.2} < {*preferred.mantissas("E24")}
    assert 9.2 in preferred.mantissas("E192") and {4.99, 9.76} < {*preferred.mantissas("E96")}
    assert [len(set(preferred.mantissas(name))) for name in preferred.SERIES] == [
        3,
        6,
        12,
        24,
        48,
        96,
        192,
    ]
    assert preferred.between("E6", 1e3, 1e4) == (
        1000.0,
        1500.0,
        2200.0,
        3300.0,
        4700.0,
        6800.0,
        10000.0,
    )
    assert preferred.nearest("E24", 5.15e5) == 510e3


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("load.resistance", "KEY=SPREAD"),
        ("load.resistence=5%", "did you mean 'resistance'"),
        ("load.resistance=5", "10%, LOW:HIGH"),
        ("load.resistance=-5%", "between 0 % and 100 %"),
        ("load.resistance=2M:1M", "LOW below HIGH"),
        ("load.resistance=1 F:2 F", "1 F"),
        ("load.resistance=E25:5%", "must be a load resistance"),
        ("load.resistance=normal:1M:-1", "above 0"),
        ("load.resistance=triangular:1M:3M:2M", "LOW <= MODE <= HIGH"),
        ("load.resistance=", "10%, LOW:HIGH"),
        ("stop.gap=5%", "is missing: give LOW:HIGH"),
        ("load.netlist=a:b", "a number"),
    ],
)
def test_bad_spread(text, words):
    with pytest.raises(hv.InputError, match=words):
        parse(text, PLATE)


def test_no_spread_or_the_same_twice():
    with pytest.raises(hv.InputError, match="left out"):
        spreads([], PLATE)
    with pytest.raises(hv.InputError, match="only once"):
        spreads(["load.resistance=5%", "load.resistance=6%"], PLATE)


def test_correlated_places_keep_their_distributions():
    """The correlation of the normal numbers behind is the one asked for; each column is still uniform."""
    matrix = design.correlation(["a,b=.7"], ["a", "b", "c"])
    u = design.tied(design.sobol_points(8192, 3, 0), matrix)
    normal = stats.norm.ppf(u)
    np.testing.assert_allclose(np.corrcoef(normal.T), matrix, atol=0.01)
    assert max(stats.kstest(u[:, k], "uniform").statistic for k in range(3)) < 0.005


@pytest.mark.parametrize(
    ("pairs", "words"),
    [
        (["a,b"], "KEY,KEY=NUMBER"),
        (["a,b=x"], "KEY,KEY=NUMBER"),
        (["a,d=.5"], "varied key"),
        (["a,a=.5"], "two different keys"),
        (["a,b=1.5"], "between -1 and 1"),
        (["a,b=.9", "b,c=.9", "a,c=-.9"], "true together"),
    ],
)
def test_bad_correlation(pairs, words):
    with pytest.raises(hv.InputError, match=words):
        design.correlation(pairs, ["a", "b", "c"])
