"""The trial of an ngspice: the installed one passes it, and one that does not do what it is told is found."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import pytest

from harvester.errors import MissingProgramError

pytestmark = [pytest.mark.ngspice, pytest.mark.slow]


def tried(fault):
    """In a process of its own, where no version counts as tested: what is reported of a lock-step with a fault."""
    from harvester.cosimulation.ngspice import deck, trial

    trial.TESTED = ()
    if fault == "rule":  # as of a version that does not obey the weight of the trapezoidal rule
        deck.rule_weight = lambda z: 0.5
    if fault == "time":  # as of one that does not end its steps where it is told to
        trial.EVENT += 1e-6
        trial.SteadyMotion.jump = lambda self, s: trial.TrialState(s.x, s.v, s.t)
    try:
        return trial.checked_ngspice().ngspice_version, ""
    except MissingProgramError as error:
        return 0, str(error)


@pytest.mark.thorough("test_agreement_of_parallel_sshi")
@pytest.mark.parametrize(("fault", "told"), [("", ""), ("rule", "off by"), ("time", "end a step")])
def test_trial(fault, told):
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        version, error = pool.submit(tried, fault).result()
    assert (version >= 39) is (told == "")
    assert told in error and "\n" not in error
