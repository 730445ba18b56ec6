"""The compiled kernels: the equation of motion, stops, excitation, noise, and the sums that become moments."""
