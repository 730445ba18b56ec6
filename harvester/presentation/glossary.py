"""What the names of results mean: label, kind of unit, symbol, and one sentence.

A result's field is shown by its name's term here.  ``kind`` is an attribute of
`harvester.presentation.answer_units.AnswerUnits`, so that the unit is that of the scene; "clock" is a time of
computing, always in seconds; "share" is shown in percent; "" is a number without a unit.
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
    engine=("engine", "", "What computed it: see the page on engines."),
    mean_power=("mean power", "power", "The mean over time of what the load takes.", "E[P]"),
    mean_square_voltage=(
        "mean square voltage",
        "mean_square_voltage",
        "The mean over time of the square of the piezo's voltage.",
        "E[V^2]",
    ),
    packets_per_hour=("packets an hour", "", "Packets that the node sent, over all the time."),
    share_running=("runs, of the time", "share", "The share of the time after its first packet in which it runs."),
    first_packet=("first packet after", "s", "When the first packet was sent."),
    brown_outs=("brown-outs an hour", "", "How often the store fell below the voltage at which the node stops."),
    harvested=("harvested", "W", "The mean power that comes into the store beyond what the clamp takes."),
    needed=("needed while it runs", "W", "The mean power that the node takes from the store while it runs."),
    limit=("limited by", "", "What limits the packets: interval, energy, store, wake_voltage or time."),
    available=("available at the voltage needed", "W", "The mean power that is there at the voltage needed."),
    circuit=("circuit", "", "The name of the netlist."),
    coil=("coil", "", "The coil that was chosen, of those that can be bought."),
    L=("L", "H", "The inductance of the coil."),
    Rcoil=("Rcoil", "ohm", "The resistance of the coil's wire."),
    Rcore=("Rcore", "ohm", "What stands across the coil for the losses of its core."),
    load_resistance=(
        "load that takes what is needed",
        "ohm",
        "The resistance that takes the power at the voltage needed.",
    ),
    capacitor=("capacitor", "F", "The store, of the series E6."),
    wake=("awake after", "s", "The time from an empty store to the voltage needed."),
    largest_displacement=("largest displacement", "m", "The largest displacement on the way to that voltage."),
    share_met=("devices that meet everything", "share", "The share of the devices of the spread that do."),
    share_met_between=("that share, 95 %", "share", "The interval of that share."),
    meets=("meets everything", "", "Whether the device of the scene meets every requirement."),
    runner_up=("runner-up", "", "The circuit that comes second."),
    candidates=("candidates", "", "The circuits that were looked at."),
    days=("days", "", "How long the node was followed."),
    share_of_possible=("of the possible", "share", "The power over the most that any device of this mass could take."),
    bound=("most possible", "power", "The most that any device of this mass could take of the shaking."),
    energy_per_event=("energy per event", "energy", "The mean energy that the load takes of one shock or step."),
    event_rate=("rate of events", "rate", "Shocks or steps in a unit of time."),
    effects=("effects", "", "What the scene calls for, and all that was computed."),
    seconds=("seconds", "clock", "The time of the computation, without compilation."),
    steps=("steps", "", "Trajectory-steps, or steps that ngspice accepted."),
    nondimensional=("nondimensional", "", "The same numbers in units of the mass, the spring and the capacitance."),
    step=("step", "time", "The time step."),
    burn_in=("burn-in", "time", "How long transients last, which is left out of the means."),
    duration=("duration", "time", "How long a trajectory is averaged after its burn-in."),
    trajectories=("trajectories", "", "The number of trajectories side by side."),
    warm_up_seconds=("warm-up", "clock", "The time that imports, compilation and the start of ngspice took."),
    compilation_seconds=("compilation", "clock", "The time that compiling took, once for each combination of effects."),
    displacement_rms=("displacement rms", "length", "The root of the mean square displacement."),
    displacement_amplitude=("displacement amplitude", "length", "The largest displacement of a periodic response."),
    voltage_amplitude=("voltage amplitude", "voltage", "The largest voltage of a periodic response."),
    displacement_phase=("displacement phase", "degrees", "The phase of the displacement behind the shaking."),
    voltage_phase=("voltage phase", "degrees", "The phase of the voltage behind the shaking."),
    ledger_residual=("ledger residual, of its largest entry", "share", "What the energy ledger is off by."),
    power_balance=("power balance, of the power in", "share", "What the power balance is off by."),
    slow_share=("slow share of E[V^2]", "share", "The share of E[V^2] that swings slower than the mass."),
    step_error=("step error", "power", "The part of the error of the mean power that the step has."),
    tolerance_error=(
        "tolerance error",
        "power",
        "The part of the error of the mean power that ngspice's tolerance has.",
    ),
    settling_error=(
        "settling error",
        "power",
        "The part of the error of the mean power that settling further may have.",
    ),
    warnings=("warnings", "", "Doubts about the result."),
    reason=("reason", "", "Why an error is not stated, or how it is known."),
    probes=("probes", "", "Other quantities of the circuit that were asked for."),
    responses=("responses", "", "Responses to the same steady drive from other starts."),
    share_of_starts=("share of starts", "share", "The share of starts that come to a response."),
    mean=("mean", "own", "The mean over time."),
    rms=("rms", "own", "The root of the mean square."),
    least=("least", "own", "The smallest value in the window, on average over the runs."),
    largest=("largest", "own", "The largest value in the window, on average over the runs."),
    window=("window", "time", "The time that extremes are for."),
    error=("error", "", "Why there is no number."),
    low95=("from", "", "The lower end of the 95 % interval."),
    high95=("to", "", "The upper end of the 95 % interval."),
    boundary=("end of its range", "", "The end of the range that the best value is at."),
    off=("error of a power, 95 %", "share", "The relative error of each sample's power, or what is common to all."),
    sample_count=("samples", "", "The number of devices, those without an answer too."),
    standard_deviation=("standard deviation", "power", "The standard deviation of the powers."),
    first=("variance share", "", "The share of the variance of the power that a key brings alone."),
    first_error95=("+-", "", "The 95 % error of that share."),
    total=("with others", "", "The share of the variance that a key brings alone and together with others."),
    total_error95=("+-", "", "The 95 % error of that share."),
    voltage_rms=("RMS voltage", "voltage", "The root of the mean square voltage."),
    Extremes=("largest values over a lifetime",),
    IdentificationResult=("what measurements say of a device",),
    impact_rate=("impacts, mean rate", "rate", "The mean number of impacts in a unit of time."),
    Densities=("densities without sampling", "", "How displacement, velocity, voltage and impacts are distributed."),
    displacement_mean=("displacement, mean", "length", "The mean displacement."),
    velocity_rms=("velocity rms", "speed", "The root of the mean square velocity."),
    hop_rate=("hops between wells, mean rate", "rate", "The mean number of hops, of either way, in a unit of time."),
    first_passage_time=("first passage, mean time", "time", "The mean time until a displacement is first passed."),
    largest_error=("largest error of a density", "share", "What a coarser mesh or fewer terms change, over its peak."),
    spectrum_error=("error of the spectrum", "share", "What a finer mesh changes of the spectrum at the resonance."),
    lifetime=("lifetime", "time", "How long a device is used."),
    evaluation_count=("evaluations", "", "How many places were evaluated, by all engines together."),
    scanned=("scanned", "", "Whether the whole range was looked at."),
    is_sound=("sound", "", "Whether it has settled, was not cut off, and some error of it is known."),
    on_front=("on the front", "", "Whether no other design has more power and a better other quantity."),
    on_a_long_path=("on a long path", "", "What a long path of the best design itself says."),
    share=("share", "share", "The share of the devices that may have less power."),
    met=("all limits met", "", "Whether the design keeps all limits."),
    best=("best circuit", "", "The circuit of most power."),
    PaperFigure=("figure of the paper", "", "Published theory, ours and Monte Carlo."),
    Cost=("what accuracy costs", "", "Seconds against errors, engine by engine."),
    reference=("reference", "", "What the others are measured against."),
    sampling_error=("sampling", "share", "The relative half-width of the 95 % interval of sampling."),
    step_bias=("step", "share", "The relative bias of the step."),
    model_bias=("model", "share", "The relative bias of the model."),
    total_error=("total", "share", "All errors together, unknown parts at their upper bound."),
    Stability=("top Lyapunov exponent", "", "The growth near rest."),
    verdict=("rest", "", "Whether rest is stable, by Monte Carlo."),
    published=("published", "rate", "By the paper's formula, misprints corrected."),
    averaged_exponent=("averaged", "rate", "By our averaging."),
    ensemble=("ensemble", "rate", "By Monte Carlo."),
    noiseless=("without noise, exact", "rate", "The exact value without noise."),
    Comparison=("engines side by side", "", "Every engine that can serve a scene."),
    difference=("difference", "%", "How much higher or lower the power is than the reference's."),
    z=("z", "", "The difference over the standard errors of sampling of both."),
    spice_rms_error=("V of ngspice against the exact update", "", "The relative RMS difference."),
    decoupled_rms_error=("decoupled V against ngspice", "", "The relative RMS difference."),
    paths=("one path: relative RMS difference of V", "", "The voltage on one noise path from three sources."),
    title=("scene", "", "What is drawn."),
    SweepTable=("sweep", "", "The power by engines at values of scene keys."),
    number_of_impacts=("impacts", "", "How many impacts a path has."),
    direction=("direction", "", "The way over the frequencies: up, down, or each from rest."),
    frequency=("frequency", "frequency", "The frequency of the drive."),
    peak_power=("peak power", "power", "The largest mean power over the frequencies."),
    peak_frequency=("peak frequency", "frequency", "The frequency of the largest mean power."),
    half_power_bandwidth=("half-power bandwidth", "frequency", "Between the frequencies of half the largest power."),
    voltage_rms_per_g=("RMS voltage per g", "V/g", "The RMS voltage over the base's amplitude in g."),
    mean_power_per_g2=("mean power per g^2", "W/g^2", "The mean power over the square of the base's amplitude in g."),
    spread_of_trajectories=("spread", "share", "How far trajectories differ in power, relative to the largest."),
    probe=("probe", "", "The quantity of the circuit that is looked at."),
    target=("target", "own", "What the probe is to reach."),
    time=("mean time", "time", "The mean time from empty."),
    lower_bound=("mean time at least", "time", "A lower bound of the mean time, which is not known."),
    at_least=("at least", "time", "A lower bound of the mean time: who does not arrive counts as the duration."),
    low=("5 % have after", "time", "The time by which 5 % of the runs have arrived."),
    high=("95 % have after", "time", "The time by which 95 % of the runs have arrived."),
    reached=("reached by", "share", "The share of the runs that arrive."),
    reached_between=("reached, 95 %", "share", "The interval of that share."),
    runs=("runs", "", "The number of runs."),
    afterwards=("then at or above it", "share", "The share of the time after the first arrival."),
    rises=("rises to it", "", "How often a run rises to the target, on average."),
    voltage=("voltage", "own", "A voltage on the way."),
    energy=("energy there", "energy", "The energy in the store."),
    power=("power on the way", "power", "The mean power from the level before."),
    power_to_target=("mean power to there", "power", "The energy at the target over the mean time to it."),
    strongest=("largest power on the way", "", "The level on whose way the store takes the most power."),
    levels=("on the way", "", "Voltages up to the target."),
)


LEDGER = "ledger_"  # before the names of mean powers of the energy ledger


def term(name: str) -> Term:
    """What a name means; one that is not in the glossary stands for itself."""
    return GLOSSARY.get(name) or Term(name.replace("_", " "), "power" if name.startswith(LEDGER) else "")
