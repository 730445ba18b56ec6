"""From a datasheet or a measurement to a scene, and the meaning of its numbers."""
