"""The electrical side in ngspice, in lock-step with the mass."""
