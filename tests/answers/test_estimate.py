"""An answer shows itself from its fields: text with units, a short repr, and JSON."""

import harvester as hv
from harvester.presentation.answer_units import NONDIMENSIONAL, SI
from harvester.presentation.sheet import mapping_rows

DETAILS = {
    "step": 0.003337,
    "burn_in": 11.21,
    "trajectories": 4096.0,
    "warm_up_seconds": 7.596,
    "power_balance": 0.0239,
    "power_balance_stderr": 0.01,
    "power_balance_bias": 0.001,
    "ledger_input": 8.1e-6,
    "ledger_residual": -0.0003,
    "step_error": 2e-9,
    "slow_share": 0.1361,
    "exchange_per_cycle": 0.6788,
}


def test_details_have_units():
    assert mapping_rows(DETAILS, SI) == [
        ("step", "3.337 ms"),
        ("burn-in", "11.21 s"),
        ("trajectories", "4096"),
        ("warm-up", "7.6 s of computing"),
        ("power balance, of the power in", "2.4 +- 2 (95 %, sampling) +- 0.1 (step) %"),
        ("energy balance, input", "8.1 uW"),
        ("energy balance residual, of its largest entry", "-0.03 %"),
        ("step error", "2 nW"),
        ("slow part of E[V^2]", "about 14 %"),
        ("noise energy per cycle, of the mean energy", "about 68 %"),
    ]


def test_a_nondimensional_scene_says_what_its_times_are():
    found = dict(mapping_rows(DETAILS, NONDIMENSIONAL))
    assert (found["step"], found["energy balance, input"]) == ("0.003337 (1/w0)", "8.1e-06")
    assert found["warm-up"] == "7.6 s of computing"


def test_answers_print_themselves_in_python():
    answer = hv.Averaged().run("examples/plate_with_stop.toml")
    power = answer.mean_power.format("W")
    assert repr(answer).startswith(
        f"Estimate(engine='averaged', mean_power={power}, "
    ) and "\n" not in repr(answer)
    assert str(answer).splitlines()[1].split()[:3] == [
        "mean",
        "power",
        f"{1e6 * answer.mean_power.value:.3g}",
    ]
    assert repr(answer.mean_square_voltage) == answer.mean_square_voltage.format("")
    assert str(hv.Value(-0.08, stderr=1e-3).format("1/s")).endswith(" 1/s")  # and no milli of it


def test_a_text_says_what_json_says():
    answer = hv.Averaged(within="0.1%").run("examples/plate_with_stop.toml")
    found = answer.as_json()
    assert {one["message"] for one in found["diagnostics"]} == {*found["warnings"], found["reason"]}
    assert all(f"  warning: {said}" in str(answer).splitlines() for said in found["warnings"])
    assert f"  note: {found['reason']}" in str(answer)
