"""`harvester new`: a scene file from what a datasheet or a measurement says, and what its numbers mean."""
