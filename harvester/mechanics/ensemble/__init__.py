"""Many trajectories: burn-in, moments with their errors, the time-step bias, Lyapunov exponents."""
