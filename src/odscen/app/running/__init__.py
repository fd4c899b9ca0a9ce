"""Running scenarios: one, many, watched, resumed, with seeds for an interval; their reports."""
