"""How often a stop is hit, from the linear equations without it."""

import numpy as np
import pytest

import harvester as hv
from harvester.devices.interpretation import meaning
from harvester.devices.linear_response import amplitude, variances
from harvester.equations.bounds import flow
from harvester.equations.coefficients import Equations
from harvester.equations.modes import Modes
from tests.support.datasheet import NOISE, SHEET, problem_of
from tests.support.systems import lyapunov


def test_stop_without_noise_or_with():
    """Variances by the Lyapunov equation; the excitation's amplitude by the linear system."""
    eqs = Equations(beta=0.7, mu=0.6, c1=-0.1, n1=0.3, drive=2.0, drive_frequency=1.3)
    assert variances(eqs) == pytest.approx(np.diag(lyapunov(eqs))[:2])
    x = np.linalg.solve(1.3j * np.eye(3) - flow(eqs), np.array([0.0, eqs.drive, 0.0]))
    assert amplitude(eqs) == pytest.approx(abs(x[0]))


def test_what_meets_the_stop_of_several_modes():
    """It is the sum phi.y of all displacements: by the integral of its response to noise, and at one frequency."""
    modes = Modes((0.0, 9.0), (0.0, 0.06), (1.0, -0.5), (1.0, 0.4), (1.0, -0.7))
    eqs = Equations(beta=0.3, mu=0.6, c1=-0.1, n1=0.3, drive=2.0, drive_frequency=1.3, modes=modes)
    base, contact = (
        np.array([0.0, 0.0, *modes.base, 0.0]),
        np.array([*modes.contact, 0.0, 0.0, 0.0]),
    )
    w = np.linspace(-60.0, 60.0, 120_001)
    response = (
        np.linalg.solve(1j * w[:, None, None] * np.eye(5) - flow(eqs), base[:, None])[..., 0]
        @ contact
    )
    x2, v2 = (np.trapezoid(0.3 / np.pi * abs(response) ** 2 * power, w) for power in (1.0, w * w))
    found = variances(eqs)
    assert found[0] == pytest.approx(x2, rel=1e-4)
    assert found[1] == pytest.approx(v2, rel=0.02)  # the integral falls as 1/w^2
    at = np.linalg.solve(1.3j * np.eye(5) - flow(eqs), 2.0 * base) @ contact
    assert amplitude(eqs) == pytest.approx(abs(at))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("gap", "often"), [("0.1 mm", "often"), ("0.5 mm", "at times"), ("3 mm", "seldom or never")]
)
def test_rate_of_a_distant_stop(gap, often):
    """Rice's rate of a linear mass, counted on one path."""
    flags = {**SHEET, **NOISE, "restitution": "1", "gap": gap, "resistance": "1 Mohm"}
    problem = problem_of(flags)
    found = meaning(problem).facts
    assert found["stop"] == often
    if often == "often":
        path = hv.motion(problem.scene.without_stop(), duration=300.0)
        x = path.displacement[path.time > 20.0]
        passed = np.count_nonzero((x[1:] < -1e-4) & (x[:-1] >= -1e-4)) / (path.time[-1] - 20.0)
        assert passed == pytest.approx(found["stop_hits_a_second"], rel=0.1)
