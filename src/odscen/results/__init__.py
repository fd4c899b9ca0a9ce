"""From trajectories and events to figures and a report."""
