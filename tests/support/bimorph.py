"""The measured bimorph of docs/formulas.md with a circuit, as a scene file."""

_SCENE = """
[oscillator]
mass = "16.542 g"
stiffness = "1364.1 N/m"
damping_ratio = 0.027
[piezo]
coupling = "2.5261e-3 N/V"
capacitance = "41.259 nF"
[excitation]
acceleration_amplitude = "{level}"
frequency = "{frequency}"
{stop}
[load]
netlist = "{netlist}"
parameters = {{ {parameters} }}
"""


def bimorph(parameters, level="0.25 g", frequency="46 Hz", netlist="bridge", stop=""):
    """The text of its scene file; ``parameters`` are those of the netlist, ``stop`` a table of its own."""
    return _SCENE.format(
        parameters=parameters, level=level, frequency=frequency, netlist=netlist, stop=stop
    )
