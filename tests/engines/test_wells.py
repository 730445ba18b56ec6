"""Transitions between unlike wells that are too rare to wait for: an answer at once, with their
rate and an honest error."""

import pytest

import harvester as hv
from harvester.equations.coefficients import Equations
from tests.support.systems import changed, scene

WELLS = Equations(linear=-1.0, alpha=1.0, alpha2=0.1, beta=0.1, mu=0.5, c1=-0.05, n1=0.001)


@pytest.mark.thorough("test_burn_in_waits_for_rare_hops")
@pytest.mark.statistics
def test_rare_hops_end_in_an_answer():
    """It once continued for minutes; the mean of either well is within the error, and the target is not promised."""
    answer = hv.Ensemble(within="1%").run(scene(WELLS))
    power = answer.mean_power
    assert power.model > 0.01 * power.value
    assert power.error95 == pytest.approx(power.sampling95 + power.bias + power.model)
    rare, missed = map(str, answer.warnings)
    assert rare.startswith(
        "transitions between the wells at x = -1.051 and x = 0.9512 are rare: 0 in "
    )
    assert (
        "(Kramers' formula: about one in 4e+07/w0), so a mean over the wells would need a burn-in of about "
        in rare
    )
    assert (
        missed
        == "`within` 1 % cannot be guaranteed: the mean is only known to lie between those of the wells"
    )


@pytest.mark.thorough("test_burn_in_waits_for_rare_hops")
@pytest.mark.statistics
def test_an_answer_between_wells_may_suffice():
    answer = hv.Ensemble(within="30%").run(scene(WELLS))
    assert answer.mean_power.known_error95 < 0.3 * answer.mean_power.value
    assert len(answer.warnings) == 1


@pytest.mark.thorough("test_burn_in_waits_for_rare_hops")
@pytest.mark.statistics
def test_often_hops_are_waited_for():
    """The whole law's mean, without an error of the model."""
    answer = hv.Ensemble(within="3%").run(scene(changed(WELLS, n1=0.01)))
    assert answer.mean_power.model is None
    assert answer.warnings == ()
