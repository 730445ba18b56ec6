"""Files of impedance analysers: each is read as the same complex numbers, or refused with the remedy."""

import numpy as np
import pytest

import harvester as hv
from harvester.errors import InputError
from harvester.identification.read import read_file
from tests.support.analysers import FILES, MAGNITUDES, SIZE, TRUTH, F, S, Z, table, traces


@pytest.mark.parametrize("name", FILES)
def test_files_of_analysers(tmp_path, name):
    file, text = FILES[name]
    (tmp_path / file).write_text(text)
    [data] = read_file(str(tmp_path / file))
    assert data.phase_known
    np.testing.assert_allclose(data.f, F, rtol=1e-8)
    np.testing.assert_allclose(data.z, Z, rtol=1e-5)


@pytest.mark.parametrize("name", MAGNITUDES)
def test_a_magnitude_alone_is_fitted_as_one(tmp_path, name):
    """Each true value is inside of its interval, widened to twice, and the answer states that the phase is unknown."""
    file, text = MAGNITUDES[name]
    (tmp_path / file).write_text(text)
    [data] = read_file(str(tmp_path / file))
    assert not data.phase_known
    found = hv.identify(str(tmp_path / file))
    assert [line.code for line in found.diagnostics if line.code == "magnitude_alone"]
    right = TRUTH.parameters(
        "short_circuit_frequency", "quality_factor", "piezo.capacitance", "dielectric_loss"
    )
    values = {p.key: p for p in found.parameters}
    for key, true in right.items():
        parameter = values[key]
        assert abs(parameter.value - true) < parameter.high - parameter.low, key


@pytest.mark.parametrize(
    ("file", "text", "says"),
    [
        (
            "a.csv",
            table(SIZE),
            "'frequency (Hz),|Z| (ohm),phase (deg)', but has none: write that line",
        ),
        ("a.csv", "f (Hz),R (ohm),X (ohm)\n" + table(F, SIZE, 0 * F), "name it '|Z| (ohm)' alone"),
        (
            "a.csv",
            "f (Hz),R (ohm),X (ohm),|Z| (ohm)\n" + table(F, Z.real, Z.imag, 2 * SIZE),
            "columns of one impedance",
        ),
        (
            "a.s1p",
            "# Hz S MA R 50\n" + table(F, SIZE, F, F, F),
            "export the reflection of one port",
        ),
        ("a.s1p", "# Hz S XX R 50\n" + table(F, SIZE, F), "must have options such as"),
        ("a.txt", traces("LEVEL MONITOR", SIZE), "a measure parameter such as"),
        (
            "a.csv",
            "freq[Hz],re:S11,im:S11\n" + table(F, S.real, S.imag),
            "has 're:S11, im:S11', a reflection whose reference impedance it does not state: export a "
            "Touchstone file (.s1p)",
        ),
        (
            "a.csv",
            "f (Hz),|S11|,arg S11 (deg)\n" + table(F, abs(S), np.degrees(np.angle(S))),
            "a reflection whose reference impedance",
        ),
        (
            "a.csv",
            "Frequency (Hz),Gamma re,Gamma im\n" + table(F, S.real, S.imag),
            "a reflection whose reference impedance",
        ),
        ("a.csv", "f (Hz),Z' (ohm)\n" + table(F, Z.real), "must hold frequency with |Z| and phase"),
        ("a.txt", traces("IMPEDANCE MAG PHASE (DEG)", Z), "an imaginary part of 0 in its traces"),
    ],
    ids=range(11),
)
def test_refusals_have_the_remedy(tmp_path, file, text, says):
    (tmp_path / file).write_text(text)
    with pytest.raises(InputError) as caught:
        read_file(str(tmp_path / file))
    assert says in str(caught.value)
