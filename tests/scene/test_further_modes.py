"""Further modes and a magnifier in a scene: what is read, varied and written, and the refusals in one line."""

import re

import pytest

import harvester as hv
from tests.support.systems import BEAM, SECOND, THIRD

THREE = BEAM.replace(mode=(SECOND, THIRD))


def test_keys_of_a_mode_are_varied_and_written():
    """The number of a mode counts from the oscillator, which is the first."""
    found = THREE.varied(
        {"mode.3.frequency": "900 Hz", "mode.2.base": None, "load.resistance": "1 kohm"}
    )
    assert [one.frequency for one in found.mode] == [310.0, 900.0]
    assert found.mode[0].base is None and found.mode[0].coupling == SECOND.coupling
    assert hv.loads(found.to_toml()) == found
    assert ("mode", "3.at_stop", -1.0) in found.values()


BALL = hv.Ball(mass="1 g", room="1 mm", restitution=0.5)
MAGNIFIER = hv.Magnifier(mass="20 g", stiffness="1 N/mm", restitution=0.5)


@pytest.mark.parametrize(
    "make, line",
    [
        (
            lambda: BEAM.replace(mode=(THIRD, SECOND)),
            "mode.3.frequency must be above that of the mode before, 880 Hz, but is 310",
        ),
        (
            lambda: BEAM.vary("mode.2.coupling", "0.1 N/V"),
            "mode.2.coupling must be below 0.04771 N/V in size, at which the piezo holds all the energy of the mode's",
        ),
        (
            lambda: BEAM.vary("mode.3.mass", 1.0),
            "mode.3.mass must be of a mode that the scene has, 2 at most, but is",
        ),
        (
            lambda: BEAM.vary("mode.mass", 1.0),
            "'mode.mass' must have the number of a further mode, such as mode.2.mass",
        ),
        (lambda: BEAM.vary("mode.2.mas", 1.0), "unknown [[mode]] key 'mas': did you mean 'mass'?"),
        (
            lambda: hv.Magnifier(mass=1.0, stiffness=1.0, gap=1e-3),
            "magnifier.restitution must be given with gap",
        ),
        (
            lambda: BEAM.replace(magnifier=MAGNIFIER),
            "[[mode]] must be left out next to [magnifier], but both are given",
        ),
        (
            lambda: BEAM.replace(mode=(), magnifier=MAGNIFIER, stop=hv.Stop(restitution=1.0)),
            "magnifier.restitution must be left out next to [stop], but both are given",
        ),
        (
            lambda: hv.Ball(mass=1e-3, room=0.0, restitution=0.5),
            "ball.room must be a free way (m), such as '4 mm', above",
        ),
        (lambda: hv.Ball(mass=1e-3, restitution=0.5), "ball.room must be given"),
        (
            lambda: BEAM.replace(ball=BALL, stop=hv.Stop(restitution=1.0)),
            "[stop] must be left out next to [ball], but both are given",
        ),
        (
            lambda: hv.run(BEAM.replace(ball=BALL), "exact"),
            "engine 'exact', for linear equations, cannot model impact",
        ),
        (
            lambda: BEAM.replace(excitation=hv.Excitation(stiffness_noise=0.1)),
            "excitation.stiffness_noise must be left out next to [[mode]], but both are given",
        ),
        (
            lambda: hv.run(BEAM, "density"),
            "engine 'density' cannot model further modes: use engine 'ensemble'",
        ),
    ],
)
def test_refusals(make, line):
    with pytest.raises(hv.InputError, match=f"^{re.escape(line)}"):
        make()
