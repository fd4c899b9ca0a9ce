"""What is asked of a run: expectations, criteria of its scenario, and the verdicts."""
