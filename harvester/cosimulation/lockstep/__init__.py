"""How the mass and ngspice advance together: state, transitions, stops, and the energy balance."""
