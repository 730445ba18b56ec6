"""An FMU next to the package's own kernels: the same path to 1e-13, the same mean power, and orders of a master."""

import math
import runpy

import numpy as np
import pytest

import harvester as hv
from harvester.devices.fmu import fixed_scales, parts
from harvester.equations.problem import Problem
from harvester.mechanics.trace import trace
from tests.support import fmu
from tests.support.paths import EXAMPLES

pytest.importorskip("fmpy")
pytest.importorskip("ziglang")
pytestmark = pytest.mark.slow

COMPLIANT = '[stop]\ngap = "0.5 mm"\nstiffness = "200 N/m"\ndamping = "0.5 N s/m"'
RIGID = '[stop]\nrestitution = 0.9\ngap = "0.5 mm"'
# Half-way through the steps, where the kernel has its samples
HALF_WAY = """
rows = []
for n in (1, 10, 100):
    slave = begun(opened())
    slave.doStep(0.0, 0.5 * h)
    times = [(0.5 + n * k) * h for k in range(2000 // n + 1)]
    row = []
    for t, end in zip(times, times[1:]):
        slave.doStep(t, end - t)
        row.append(shown(slave, "displacement", "voltage"))
    rows.append(row[100 // n - 1 :: 100 // n])
print(json.dumps([h, rows]))
"""


@pytest.fixture(scope="module")
def compliant(tmp_path_factory):
    """The plate of a harmonic base against a compliant stop: the file of its scene."""
    scene = tmp_path_factory.mktemp("scene") / "compliant.toml"
    text = (EXAMPLES / "plate_harmonic_stop.toml").read_text()
    assert RIGID in text
    scene.write_text(text.replace(RIGID, COMPLIANT))
    return scene


def test_the_path_is_that_of_the_kernel(compliant):
    """Displacement and voltage are those of `trace` to 1e-13 of their size, for steps of 1, 10 and 100 inner ones."""
    h, rows = fmu.run(fmu.built(str(compliant)), HALF_WAY)
    problem = Problem(hv.load(compliant))
    eqs = fixed_scales.equations(problem, problem.scales)
    step = parts.step_of(eqs)
    assert step == pytest.approx(h * problem.scales.frequency, rel=1e-15)
    shaking = eqs.drive * np.cos(eqs.drive_frequency * (step * np.arange(2001)))
    path = trace(eqs, np.zeros(2000), step, shaking=shaking)
    expected = path.samples[99::100, 2:5:2]
    units = fixed_scales.units(problem, problem.scales)
    sizes = np.abs(path.samples[:, 2:5:2]).max(axis=0)
    assert len(path.impacts) > 4
    for row in rows:
        found = np.array(row) / (units.length, units.volts)
        difference = np.abs((found - expected) / sizes).max()
        assert difference < 1e-13, difference


def test_events_on_the_grid_leave_the_path_as_it_is():
    """FMI 3.0 under noise: each impact is an event, and the path is that without event mode."""
    names = 'names = "displacement", "voltage", "load_energy"'
    with_events, without = fmu.run(fmu.built("plate_with_stop.toml", fmi=3), names + fmu.EVENTS)
    assert without[0] == 0
    assert with_events[0] == with_events[-1] == without[-1] > 20
    assert with_events[1:] == pytest.approx(without[1:], rel=1e-10)


def test_mean_power_under_noise_is_that_of_the_ensemble():
    """|z| < 4 between 24 trajectories in the FMU and `run` on as many and more of the ensemble."""
    found = np.array(fmu.powers("plate_with_stop.toml", seeds=24, energy="load_energy"))
    error = found.std(ddof=1) / math.sqrt(len(found))
    power = hv.Ensemble(seed=3, within="1%").run(EXAMPLES / "plate_with_stop.toml").mean_power
    z = (found.mean() - power.value) / math.hypot(error, power.normal_stderr)
    assert error < 0.04 * power.value
    assert abs(z) < 4.0, (found.mean(), error, power)


def test_a_master_converges_with_its_order(tmp_path):
    """A sine base and a resistor outside: first order with a held current, second with repeated steps."""
    master = runpy.run_path(str(EXAMPLES / "fmu_master.py"))
    voltage, impacts, rows = master["errors"](master["exported"](tmp_path))
    steps = np.array(list(rows))
    errors = np.abs(np.array(list(rows.values())))
    held, repeated = np.log(errors[0] / errors[-1]) / np.log(steps[0] / steps[-1])
    assert impacts > 4
    assert 0.8 < held < 1.5
    assert 1.7 < repeated < 2.7
    assert errors[-1, 1] < 1e-5 * abs(voltage)
