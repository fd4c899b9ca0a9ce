"""Every change to a scenario, as pure functions."""
