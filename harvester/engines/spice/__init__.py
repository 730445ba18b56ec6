"""Engine `spice`: its preparation, its ngspice runs, and what is concluded from them."""
