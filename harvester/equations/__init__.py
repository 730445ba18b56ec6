"""The equations that are solved: a scene in nondimensional form, their scales, and the effects that are present."""
