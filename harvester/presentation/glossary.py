"""The meaning of the names of results: label, kind of unit, symbol, and one sentence.

Long because it is one table.

A result's field is shown by its name's term here.  ``kind`` is an attribute of
`harvester.presentation.answer_units.AnswerUnits`, so that the unit is that of the scene; "clock" is
a computing time, always in seconds; "share" is shown in per cent; "parameter" is a fraction that
only scales the error of a formula, shown with two digits; "names" are effects, shown in words; ""
is a number without a unit.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Term:
    """How a name is shown."""

    label: str
    kind: str = ""
    sentence: str = ""
    symbol: str = ""


def _terms(**some: tuple[str, ...]) -> dict[str, Term]:
    return {name: Term(*term) for name, term in some.items()}


GLOSSARY = _terms(
    engine=("engine", "", "The engine that computed it: see the page on engines."),
    mean_power=("mean power", "power", "The mean over time of the load power.", "E[P]"),
    mean_square_voltage=(
        "mean square voltage",
        "mean_square_voltage",
        "The mean over time of the square of the piezo's voltage.",
        "E[V^2]",
    ),
    packets_per_hour=(
        "packets per hour",
        "",
        "Packets of the node that arrive, over all the time.",
    ),
    packets_lost=(
        "packets lost per hour",
        "",
        "Packets that are not acknowledged, in spite of all retries.",
    ),
    day_fewest=("packets of a day, at least", "", "Packets of the whole day with the fewest."),
    day_median=("packets of a day, median", "", "Half of the whole days have no more."),
    day_most=("packets of a day, at most", "", "Packets of the whole day with the most."),
    fewest=(
        "packets of an hour, at least",
        "",
        "Packets of the whole hour with the fewest, after the first packet.",
    ),
    most=(
        "packets of an hour, at most",
        "",
        "Packets of the whole hour with the most, after the first packet.",
    ),
    interval_median=(
        "time between packets, median",
        "s",
        "Half of the times from packet to packet are shorter.",
    ),
    interval_95=(
        "time between packets, 95 %",
        "s",
        "95 % of the times from packet to packet are shorter.",
    ),
    interval_longest=(
        "time between packets, longest",
        "s",
        "The longest time from one packet to the next.",
    ),
    share_running=("duty cycle", "share", "Duty cycle: the fraction of the time that it runs."),
    first_packet=("first packet after", "s", "The time of the first packet."),
    brown_outs=(
        "brown-outs per hour",
        "",
        "How often the storage fell below the voltage at which the node stops.",
    ),
    harvested=("harvested", "W", "The mean power into the storage, beyond that of the clamp."),
    needed=(
        "needed while it runs",
        "W",
        "The mean power that the node draws from the storage while it runs.",
    ),
    answer=("sends its packets", "", "Whether it keeps its interval, and its packets per day."),
    used=("used by the node", "W", "The mean power that the node consumes while it runs."),
    clamped=("dissipated by the clamp", "W", "The mean power that the clamp dissipates."),
    leaked=("leaked", "W", "The mean power through the storage's leakage resistance."),
    outage=("outage of the excitation", "s", "How long the excitation stops after the days."),
    lasts=("runs without excitation for", "s", "How long the node continues in the outage."),
    outage_packets=("packets in the outage", "", "Packets that it sends in the outage."),
    share_survived=(
        "outages that it outlasts",
        "share",
        "The fraction of outages that the storage outlasts.",
    ),
    capacitance_to_last=(
        "capacitance that would last",
        "F",
        "The smallest of series E6 with which the node outlasts the outage.",
    ),
    interval_to_last=(
        "interval that would last",
        "s",
        "The shortest interval with which the node outlasts the outage.",
    ),
    limit=(
        "limited by",
        "",
        "The limiting factor: interval, energy, store, wake_voltage, cold_start, battery, time.",
    ),
    available=(
        "available at the voltage needed",
        "W",
        "The mean power available at the required voltage.",
    ),
    circuit=("circuit", "", "The name of the netlist."),
    coil=("inductor", "", "The chosen inductor, off the shelf."),
    L=("L", "H", "The inductance of the inductor."),
    Rcoil=("Rcoil", "ohm", "The resistance of the inductor's wire."),
    Rcore=("Rcore", "ohm", "Parallel resistance that models the inductor's core loss."),
    power_needed=("power needed", "W", "Power at the required voltage."),
    load_resistance=(
        "load that draws the required power",
        "ohm",
        "The resistance that draws the required power.",
    ),
    capacitor=("capacitor", "F", "The storage capacitance, from the series E6."),
    wake=("awake after", "s", "The time from an empty capacitor to the required voltage."),
    largest_displacement=(
        "largest displacement",
        "m",
        "The largest displacement on the way to that voltage.",
    ),
    share_met=(
        "devices that meet all requirements",
        "share",
        "Yield: the fraction of such devices.",
    ),
    share_met_between=("yield, 95 %", "share", "The interval of that fraction."),
    meets=("meets everything", "", "Whether the device of the scene meets every requirement."),
    runner_up=("runner-up", "", "The second-best circuit."),
    candidates=("candidates", "", "The circuits that were compared."),
    days=("days", "", "The simulated time of the node."),
    share_of_possible=(
        "fraction of the upper bound",
        "share",
        "The power over the upper bound for any device of this mass.",
    ),
    bound=(
        "most possible",
        "power",
        "The upper bound of the power of any device of this mass under this excitation.",
    ),
    energy_per_event=(
        "energy per event",
        "energy",
        "The mean energy that one shock or step delivers to the load.",
    ),
    event_rate=("rate of events", "rate", "Shocks or steps per unit of time."),
    effects=("effects", "names", "The effects of the scene, and all results."),
    seconds=("seconds", "clock", "The time of the computation, without compilation."),
    steps=("steps", "", "Trajectory-steps, or steps that ngspice accepted."),
    nondimensional=(
        "nondimensional",
        "",
        "The same numbers in units of the mass, the spring and the capacitance.",
    ),
    step=("step", "time", "The time step."),
    burn_in=("burn-in", "time", "The duration of transients, which is left out of the means."),
    duration=("duration", "time", "The averaging time of a trajectory after its burn-in."),
    load_on=("duty cycle of the output", "share", "Duty cycle of a chip's output, once settled."),
    load_on_after=("load first on after", "s", "When the output is first on, from empty."),
    store_lowest=(
        "storage voltage, lowest",
        "V",
        "The lowest voltage of the storage, once settled.",
    ),
    store_highest=(
        "storage voltage, highest",
        "V",
        "The highest voltage of the storage, once settled.",
    ),
    trajectories=("trajectories", "", "The number of trajectories side by side."),
    warm_up_seconds=(
        "warm-up",
        "clock",
        "The time of imports, compilation and the start of ngspice.",
    ),
    compilation_seconds=(
        "compilation",
        "clock",
        "The time of compilation, once for each combination of effects.",
    ),
    displacement_rms=("displacement rms", "length", "The root of the mean square displacement."),
    displacement_amplitude=(
        "displacement amplitude",
        "length",
        "The largest displacement of a periodic response.",
    ),
    voltage_amplitude=(
        "voltage amplitude",
        "voltage",
        "The largest voltage of a periodic response.",
    ),
    displacement_phase=(
        "displacement phase",
        "degrees",
        "The phase of the displacement behind the excitation.",
    ),
    voltage_phase=("voltage phase", "degrees", "The phase of the voltage behind the excitation."),
    ledger_residual=(
        "energy balance residual, of its largest entry",
        "share",
        "The residual of the energy balance.",
    ),
    power_balance=("power balance, of the power in", "share", "The residual of the power balance."),
    exchange_per_cycle=(
        "noise energy per cycle, of the mean energy",
        "parameter",
        "Noise energy per cycle, over the mean energy; the formula assumes it small.",
    ),
    impact_loss_per_cycle=(
        "impact loss per cycle, of the mean energy",
        "parameter",
        "The energy that impacts dissipate in a cycle, over the mean energy; assumed small.",
    ),
    slow_share=(
        "slow part of E[V^2]",
        "parameter",
        "The fraction of E[V^2] that varies over many cycles instead of within one.",
    ),
    step_error=("step error", "power", "The time-step part of the mean power's error."),
    tolerance_error=(
        "tolerance error",
        "power",
        "The part of the mean power's error from ngspice's tolerance.",
    ),
    settling_error=(
        "settling error",
        "power",
        "The part of the mean power's error that settling may have.",
    ),
    warnings=("warnings", "", "Doubts about the result."),
    reason=("reason", "", "The reason for an unknown error, or the source of a known one."),
    probes=("probes", "", "Probed quantities of the circuit."),
    responses=("responses", "", "Responses to the same harmonic excitation from other starts."),
    share_of_starts=(
        "fraction of starts",
        "share",
        "The fraction of starts that lead to a response.",
    ),
    mean=("mean", "own", "The mean over time."),
    rms=("rms", "own", "The root of the mean square."),
    least=("least", "own", "The smallest value in the window, on average over the runs."),
    largest=("largest", "own", "The largest value in the window, on average over the runs."),
    window=("window", "time", "The lifetime of the extremes."),
    error=("error", "", "The reason for a missing number."),
    low95=("from", "", "The lower end of the 95 % interval."),
    high95=("to", "", "The upper end of the 95 % interval."),
    boundary=("end of its range", "", "The end of the range at which the best value lies."),
    off=(
        "power error, 95 %",
        "share",
        "The relative error of each sample's power, or the part common to all.",
    ),
    sample_count=("samples", "", "The number of devices, including those without an answer."),
    standard_deviation=("standard deviation", "power", "The standard deviation of the powers."),
    standard_deviation_error95=("its error, 95 %", "power", "The 95 % error of that deviation."),
    first=("variance share", "", "The fraction of the variance of the power due to a key alone."),
    first_error95=("+-", "", "The 95 % error of that fraction."),
    total=(
        "with others",
        "",
        "The fraction of the variance due to a key alone and together with others.",
    ),
    total_error95=("+-", "", "The 95 % error of that fraction."),
    voltage_rms=("RMS voltage", "voltage", "The root of the mean square voltage."),
    Extremes=("largest values over a lifetime",),
    IdentificationResult=("parameters of a device from measurements",),
    impact_rate=("impacts, mean rate", "rate", "The mean number of impacts per unit of time."),
    Densities=(
        "densities without sampling",
        "",
        "Distributions of displacement, velocity, voltage and impacts.",
    ),
    displacement_mean=("displacement, mean", "length", "The mean displacement."),
    velocity_rms=("velocity rms", "speed", "The root of the mean square velocity."),
    hop_rate=(
        "transitions between wells, mean rate",
        "rate",
        "Transitions of either direction, per unit of time.",
    ),
    first_passage_time=(
        "first passage, mean time",
        "time",
        "The mean time until a level is first passed.",
    ),
    largest_error=(
        "largest density error",
        "share",
        "The change by a coarser mesh, over its peak.",
    ),
    spectrum_error=(
        "error of the spectrum",
        "share",
        "The change of the spectrum at the resonance by a finer mesh.",
    ),
    lifetime=("lifetime", "time", "The time of use of a device."),
    evaluation_count=(
        "evaluations",
        "",
        "The number of evaluated points, by all engines together.",
    ),
    scanned=("scanned", "", "Whether the whole range was searched."),
    is_sound=(
        "sound",
        "",
        "Whether it has settled, was not cut off, and some error of it is known.",
    ),
    on_front=(
        "on the front",
        "",
        "Whether no other design has more power and a better other quantity.",
    ),
    on_a_long_path=(
        "on a long trajectory",
        "",
        "The result of a long trajectory of the best design itself.",
    ),
    share=("share", "share", "The fraction of the devices that may have less power."),
    met=("all limits met", "", "Whether the design keeps all limits."),
    best=("best circuit", "", "The circuit with the highest power."),
    PaperFigure=("figure of the Entropy 2026 paper", "", "Published theory, ours and Monte Carlo."),
    Cost=("the cost of accuracy", "", "Seconds against errors, engine by engine."),
    reference=("reference", "", "The reference of the others."),
    sampling_error=("sampling", "share", "The relative half-width of the 95 % sampling interval."),
    step_bias=("step", "share", "The relative time-step bias."),
    model_bias=("model", "share", "The relative model bias."),
    total_error=("total", "share", "All errors together, unknown parts at their upper bound."),
    Stability=("top Lyapunov exponent", "", "The growth near rest."),
    verdict=("rest", "", "Whether rest is stable, by Monte Carlo."),
    published=(
        "published",
        "rate",
        "By the formula of the Entropy 2026 paper, misprints corrected.",
    ),
    averaged_exponent=("averaged", "rate", "By our averaging."),
    ensemble=("ensemble", "rate", "By Monte Carlo."),
    noiseless=("without noise, exact", "rate", "The exact value without noise."),
    Comparison=("engines side by side", "", "Every engine that supports a scene."),
    difference=("difference", "%", "The difference of the power from the reference's."),
    z=("z", "", "The difference over the sampling errors (standard errors) of both."),
    spice_rms_error=("V of ngspice against the exact update", "", "The relative RMS difference."),
    decoupled_rms_error=("decoupled V against ngspice", "", "The relative RMS difference."),
    paths=(
        "one trajectory: relative RMS difference of V",
        "",
        "The voltage on one noise record from three sources.",
    ),
    title=("scene", "", "The drawn quantity."),
    SweepTable=("sweep", "", "The power by engines at values of scene keys."),
    number_of_impacts=("impacts", "", "The number of impacts of a trajectory."),
    direction=("direction", "", "The way over the frequencies: up, down, or each from rest."),
    frequency=("frequency", "frequency", "The excitation frequency."),
    peak_power=("peak power", "power", "The largest mean power over the frequencies."),
    peak_frequency=("peak frequency", "frequency", "The frequency of the largest mean power."),
    half_power_bandwidth=(
        "half-power bandwidth",
        "frequency",
        "Between the frequencies of half the largest power.",
    ),
    voltage_rms_per_g=(
        "RMS voltage per g",
        "V/g",
        "The RMS voltage over the base's amplitude in g.",
    ),
    mean_power_per_g2=(
        "mean power per g^2",
        "W/g^2",
        "The mean power over the square of the base's amplitude in g.",
    ),
    spread_of_trajectories=(
        "spread",
        "share",
        "The spread of trajectories in power, relative to the largest.",
    ),
    probe=("probe", "", "The probed quantity of the circuit."),
    target=("target", "own", "The target of the probe."),
    time=("mean time", "time", "The mean time from empty."),
    lower_bound=(
        "mean time at least",
        "time",
        "A lower bound of the mean time, which is not known.",
    ),
    at_least=(
        "at least",
        "time",
        "A lower bound of the mean time: a run that does not arrive counts as the duration.",
    ),
    low=("5 % arrive within", "time", "The time by which 5 % of the runs have arrived."),
    high=("95 % arrive within", "time", "The time by which 95 % of the runs have arrived."),
    reached=("reached by", "share", "The fraction of the runs that arrive."),
    reached_between=("reached, 95 %", "share", "The interval of that fraction."),
    runs=("runs", "", "The number of runs."),
    afterwards=(
        "duty cycle afterwards",
        "share",
        "The fraction of the time after the first arrival.",
    ),
    rises=("times it rises to it", "", "How often a run rises to the target, on average."),
    voltage=("voltage", "own", "A voltage on the way."),
    energy=("energy at the target", "energy", "The energy stored at the target voltage."),
    power=("power on the way", "power", "The mean power from the level before."),
    power_to_target=(
        "mean charging power",
        "power",
        "The energy at the target over the mean time to it.",
    ),
    strongest=("largest power on the way", "", "The level at which the charging power is largest."),
    levels=("on the way", "", "Voltages up to the target."),
)


LEDGER = "ledger_"  # before the names of mean powers of the energy balance


def term(name: str) -> Term:
    """The meaning of a name; one that is not in the glossary represents itself."""
    if name not in GLOSSARY and name.startswith(LEDGER):
        return Term("energy balance, " + name.removeprefix(LEDGER).replace("_", " "), "power")
    return GLOSSARY.get(name) or Term(name.replace("_", " "), "")
