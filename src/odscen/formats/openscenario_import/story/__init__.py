"""The storyboard as rules: triggers, actions, paths and signals."""
