"""Many trajectories: burn-in, moments with their errors, the bias of the step, Lyapunov exponents."""
