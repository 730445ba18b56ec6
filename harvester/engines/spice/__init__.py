"""Engine `spice`: its preparation, its ngspice runs, and the conclusions from them."""
