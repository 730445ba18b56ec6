"""A netlist as a compiled circuit: its equations, their kernel, and the mass that moves with it."""
