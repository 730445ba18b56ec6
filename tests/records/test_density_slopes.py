"""Tables of a density as standards print them, against integrals in closed form or by a fine sum."""

import math

import numpy as np
import pytest

from harvester.errors import InputError
from harvester.records.record_files import read_density

G = 9.80665


def navmat(f):
    """NAVMAT P-9492: +3 dB/oct to 80 Hz, 0.04 g^2/Hz to 350 Hz, -3 dB/oct to 2000 Hz."""
    return 0.04 * np.where(f < 80.0, (f / 80.0), np.where(f > 350.0, (f / 350.0) ** -1, 1.0))


FINE = np.geomspace(20.0, 2000.0, 200_001)
RMS = math.sqrt(np.trapezoid(navmat(FINE), FINE))  # 6.06 g


@pytest.mark.parametrize(
    "text",
    [
        "Frequency (Hz),PSD (g^2/Hz)\n20,+3 dB/oct\n80,0.04\n350,0.04\n2000,-3 dB/oct\n",
        "Frequency (Hz),PSD (g^2/Hz)\n20-80,+3 dB/oct\n80-350,0.04\n350-2000,-3 dB/oct\n",
        "Frequency (Hz);PSD (g²/Hz)\n20 to 80;3,0 dB/Oktave\n80 to 350;0,04\n350 to 2000;-3,0 dB/Oktave\n".replace(
            "Oktave", "octave"
        ),
        "# a standard\nf (kHz),ASD (g/rtHz)\n0.02-0.08,+3dB/oct\n0.08-0.35,0.2\n0.35-2,\u22123dB/oct\nEND\n\n",
        "Freq,PSD\nHz,g^2/Hz\n20,+3 dB/octave\n80,0.04\n350,0.04\n350-2000,-3 dB/octave\n",
        "Frequency (Hz),PSD (g^2/Hz)\n20,3 dB/oct\n80,0.04\n350,0.04\n2000,-3 dB per octave\n",
        "Frequency (Hz),PSD (g^2/Hz)\n20-80,3 dB/oct\n80-350,0.04\n350-2000,-3 dB/oct\n",
        'Frequency (Hz),PSD (g^2/Hz)\n20,"+3,0 dB/oct"\n80,"0,04"\n350,"0,04"\n2000,"-3,0 dB/oct"\n',
    ],
    ids=[
        *("rows", "ranges", "decimal comma", "roots in kHz", "both"),
        *("no sign", "no sign of a range", "quoted decimal commas"),
    ],
)
def test_slopes_in_db_per_octave(tmp_path, text):
    (tmp_path / "a.csv").write_text(text)
    found = read_density(str(tmp_path / "a.csv"))
    assert found.rms / G == pytest.approx(RMS, rel=1e-6)
    np.testing.assert_allclose(found.at(FINE[1:-1]) / G**2, navmat(FINE[1:-1]), rtol=1e-5)


def test_ranges_that_step(tmp_path):
    """Two values at one frequency are a step: 0.02 from 5 to 20 Hz, 0.005 to 200 Hz, 0.001 to 500 Hz."""
    rms = math.sqrt(0.02 * 15 + 0.005 * 180 + 0.001 * 300)
    for text in (
        "5-20,0.02\n20-200,0.005\n200-500,0.001\n",
        "5,0.02\n20,0.02\n20,0.005\n200,0.005\n200,0.001\n500,0.001\n",
    ):
        (tmp_path / "a.csv").write_text("Frequency (Hz),Amplitude (g^2/Hz)\n" + text)
        assert read_density(str(tmp_path / "a.csv")).rms / G == pytest.approx(rms, rel=1e-6)


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        ("20,+3 dB/oct\n80,-3 dB/oct\n350,6 dB/oct\n", "a value at one end of each slope"),
        ("20-80,+3 dB/oct\n", "a value at one end of each slope"),
        ("20,0.01\n20-80,+6 dB/oct\n80-350,0.02\n", "leads from 0.9617 to 15.39, not 1.923"),
        ("20,0.01\n80,+3 dB/oct\n350,0.04\n", "must have its slope between two frequencies"),
    ],
)
def test_slopes_that_no_value_determines(tmp_path, rows, says):
    (tmp_path / "a.csv").write_text("Frequency (Hz),PSD (g^2/Hz)\n" + rows)
    with pytest.raises(InputError) as caught:
        read_density(str(tmp_path / "a.csv"))
    assert says in str(caught.value)


@pytest.mark.filterwarnings("error")
def test_a_table_that_begins_at_0_hz(tmp_path):
    """The unit of its ends was the quotient of two zeros, a nan, as which the error quoted a slope."""
    text = "f (Hz),psd (g^2/Hz)\n0-20,0.01\n20-80,+3 dB/oct\n80-200,0.04\n"
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError, match="must have two ascending frequencies above 0"):
        read_density(str(tmp_path / "a.csv"))
