"""Regression gates: suites of scenarios, held against expectations and baselines (R58)."""
