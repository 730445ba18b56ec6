"""The commands, a thin layer over the library: input, call, output."""
