"""The commands, thin over the library: what is read, what is called, what is printed."""
