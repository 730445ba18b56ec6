"""The linear equations without a stop: their response in closed form, and what a record cannot tell of it."""
