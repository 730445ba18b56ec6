"""The linear equations without a stop: response in closed form, and the limits of a recording's information."""
