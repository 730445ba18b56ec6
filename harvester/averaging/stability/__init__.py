"""Top Lyapunov exponents as formulas: published, averaged, and exact where that is known."""
