"""From a datasheet to a scene: the file states exactly what the fields stated."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import harvester as hv
from harvester.devices.device import scene_tables
from harvester.devices.scene_file import text


def numbers(unit, prefixes, least=1e-6, most=1e6):
    """Values as people write them, and what they are in SI units by plain arithmetic."""
    return st.tuples(
        st.floats(least, most, allow_subnormal=False).map(lambda x: float(f"{x:.6g}")),
        st.sampled_from(prefixes),
    ).map(lambda pair: (f"{pair[0]!r} {pair[1]}{unit}" if unit else repr(pair[0]), pair[0]))


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(
    mass=numbers("g", ["", "m", "k"], 0.1, 1e3),
    spring=st.one_of(
        st.tuples(st.just("stiffness"), numbers("N/m", ["", "k"], 1.0, 1e3)),
        st.tuples(st.just("frequency"), numbers("Hz", ["", "k"], 0.1, 1e3)),
    ),
    damping=st.one_of(
        st.tuples(st.just("damping_ratio"), numbers("", [""], 1e-4, 0.9)),
        st.tuples(st.just("q"), numbers("", [""], 1.0, 1e4)),
    ),
    capacitance=numbers("F", ["n", "p", "u"], 0.1, 1e3),
    coupling=numbers("N/V", ["m", "u", ""], 1.0, 100.0),
    ratio=st.one_of(st.none(), st.floats(1.001, 3.0)),
    stop=st.one_of(
        st.none(),
        st.tuples(
            st.sampled_from([0.0, 1.0]) | st.floats(0.01, 0.99),
            st.one_of(st.none(), numbers("m", ["m", "u", ""])),
        ),
    ),
    shaking=st.one_of(st.none(), numbers("g^2/Hz", [""], 1e-6, 1e-2), st.just("harmonic")),
    resistance=st.one_of(st.none(), numbers("ohm", ["k", "M", ""], 1.0, 1e3)),
    title=st.text(max_size=30),
)
def test_round_trip(  # noqa: PLR0912
    mass, spring, damping, capacitance, coupling, ratio, stop, shaking, resistance, title
):
    """`loads` gives what each flag's text is to the scene's own reader, to the last digit."""
    flags = {
        "mass": mass[0],
        spring[0]: spring[1][0],
        damping[0]: damping[1][0],
        "capacitance": capacitance[0],
    }
    read = hv.Scene(
        oscillator=hv.Oscillator(mass=mass[0], stiffness=1.0),
        piezo=hv.Piezo(coupling=1.0, capacitance=capacitance[0]),
    )
    m, cp = read.oscillator.mass, read.piezo.capacitance
    if spring[0] == "stiffness":
        k = hv.Oscillator(mass=1.0, stiffness=spring[1][0]).stiffness
    else:
        f = hv.Excitation(acceleration_amplitude=1.0, frequency=spring[1][0]).frequency
        k = m * (2.0 * math.pi * f) ** 2
    short = math.sqrt(k / m) / (2.0 * math.pi)
    if ratio is None:
        flags["coupling"] = coupling[0]
    else:
        flags["open_circuit_frequency"] = repr(ratio * short)
    if stop is not None:
        flags["restitution"] = repr(stop[0])
        if stop[1] is not None:
            flags["gap"] = stop[1][0]
    if shaking == "harmonic":
        flags |= {"acceleration_amplitude": "0.1 g", "drive_frequency": "7 Hz"}
    elif shaking is not None:
        flags["acceleration_psd"] = shaking[0]
    if resistance is not None:
        flags["resistance"] = resistance[0]
    scene = hv.loads(text(scene_tables(flags, title)))
    assert scene.title == title
    assert (scene.oscillator.mass, scene.piezo.capacitance) == (m, cp)
    assert scene.oscillator.stiffness == pytest.approx(k, rel=1e-15, abs=0.0)
    assert scene.oscillator.damping_ratio == (
        damping[1][1] if damping[0] == "damping_ratio" else 0.5 / damping[1][1]
    )
    if ratio is None:
        assert scene.piezo == hv.Piezo(coupling=coupling[0], capacitance=capacitance[0])
    else:
        beta = scene.piezo.coupling**2 / (scene.oscillator.stiffness * cp)
        assert math.sqrt(1.0 + beta) * short == pytest.approx(ratio * short, rel=1e-12)
    if stop is None:
        assert scene.stop is None
    else:
        gap = None if stop[1] is None else stop[1][0]
        assert scene.stop == hv.Stop(restitution=stop[0], **({} if gap is None else {"gap": gap}))
    if shaking == "harmonic":
        assert scene.excitation == hv.Excitation(acceleration_amplitude="0.1 g", frequency="7 Hz")
    elif shaking is None:
        assert scene.excitation is None
    else:
        assert scene.excitation == hv.Excitation(acceleration_psd=shaking[0])
    assert scene.load == (None if resistance is None else hv.Load(resistance=resistance[0]))
