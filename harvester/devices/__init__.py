"""From a datasheet or a measurement to a scene, and what its numbers mean."""
