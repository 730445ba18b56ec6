"""Top Lyapunov exponents as formulas: published, averaged, and exact if that is known."""
