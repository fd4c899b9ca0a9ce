"""What people do, each thing once: for the command line, the page, suites, CARLA and scripts."""
