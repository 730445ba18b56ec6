"""Which options of the engines a response accepts."""

import pytest

import harvester as hv
from harvester.errors import InputError
from harvester.studies.frequency_response.engines import engines_of
from tests.support.systems import DRIVEN, scene


@pytest.mark.parametrize(
    "engine, said",
    [
        (
            hv.Exact(within=1e-4),
            "`within` must be left out of engine 'exact' for a frequency response, but is given",
        ),
        (
            hv.Ensemble(dt=0.02, trajectories=5),
            "`trajectories`, `dt` must be left out of engine 'ensemble'",
        ),
        (
            hv.Ideal(duration=1.0, budget=0.1),
            "`budget`, `duration` must be left out of engine 'ideal'",
        ),
        (
            hv.Spice(probe=("store",)),
            "`probe` must be left out of engine 'spice' for a frequency response, but is given",
        ),
    ],
)
def test_options_that_a_response_does_not_use(engine, said):
    with pytest.raises(InputError, match=said):
        hv.response(scene(DRIVEN), [0.9, 1.0], engine=engine)
    kept = hv.Spice(within=1e-2, reltol=1e-5), hv.Ideal(seed=3), hv.Ensemble()
    assert engines_of(scene(DRIVEN), kept) == list(kept)
