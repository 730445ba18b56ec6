"""What an engine says of a scene, and how it prints itself on a terminal and in a notebook."""
