"""The best design of devices whose parts scatter: a quantile of the power in place of the mean, under limits."""
