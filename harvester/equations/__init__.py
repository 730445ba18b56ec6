"""What is solved: a scene as nondimensional equations, their scales, and the effects that are present."""
