"""The same scenario in CARLA: SUMO drives, a CARLA server shows it, actor for actor."""
