"""The mechanics: the step of the coupled equations, compiled, for many trajectories or one path."""
