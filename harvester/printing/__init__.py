"""What a table looks like on a terminal and in a notebook."""
