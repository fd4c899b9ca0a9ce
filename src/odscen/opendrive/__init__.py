"""OpenDRIVE text to road model, and its evaluation."""
