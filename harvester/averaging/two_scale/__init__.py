"""Impact-aware averaging on two time scales: the true voltage of an orbit with a stop."""
