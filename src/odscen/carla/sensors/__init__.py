"""What a run sees in CARLA: cameras, and their pictures as files."""
