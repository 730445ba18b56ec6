"""Netlists that give energy: growth and a load that gives power are named errors, and the
unharvested part is reported."""

import pytest

import harvester as hv
from harvester.errors import InputError, UnboundedResponseError

LOAD = ".subckt load p n R=1Meg\n{}\n.ends\n"
SCENE = """
[oscillator]
mass = "40 g"
stiffness = "16 N/m"
damping = "32e-3 N s/m"
[piezo]
coupling = "1e-3 N/V"
capacitance = "50.2 nF"
[excitation]
acceleration_psd = "1e-5 g^2/Hz"
[load]
netlist = "./load.cir"
"""


def answer(tmp_path, *lines):
    """The answer of short runs on a load of these lines."""
    (tmp_path / "load.cir").write_text(LOAD.format("\n".join(lines)))
    (tmp_path / "scene.toml").write_text(SCENE)
    return hv.Spice(trajectories=4, duration=20.0, budget="30s").run(tmp_path / "scene.toml")


@pytest.mark.ngspice
def test_growth_is_a_named_error_before_numbers_overflow(tmp_path):
    """Printed as 1e85 MW with an error bar, or with warnings of overflows, before."""
    with pytest.raises(
        UnboundedResponseError, match=r"its energy grew .* times .*a negative capacitor or resistor"
    ):
        answer(tmp_path, "Rload p n {R}", "R2 p n {-R/2}")


@pytest.mark.parametrize("more", [(), ("R2 p n {R/2}",)])
def test_a_load_below_zero_is_refused_before_anything_runs(tmp_path, more):
    with pytest.raises(
        InputError, match=r"load.cir line 2 must be above 0, for Rload, but is -1000000"
    ):
        answer(tmp_path, "Rload p n {-R}", *more)


@pytest.mark.thorough("test_what_the_ledgers_tell")
@pytest.mark.ngspice
def test_power_that_the_netlist_gives_is_told(tmp_path):
    """A source of -1 uS beside the load of 2 uS gives half of what that dissipates; a stable
    negative capacitor nothing."""
    (word,) = answer(tmp_path, "Rload p n {R/2}", "R2 p n {-R}").warnings
    assert (
        str(word) == "the netlist supplies 50 % of the load power: that fraction is not harvested"
    )
    assert answer(tmp_path, "Rload p n {R}", "C1 p n -10n").warnings == ()
