"""Run folders: names of files, states, and what is kept for resuming."""
