"""The compiled kernels: the equation of motion, stops, shaking, noise, and the sums that become moments."""
