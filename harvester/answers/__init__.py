"""The answer of an engine to a scene, and how it prints itself on a terminal and in a notebook."""
