"""The reference generator: a small model of traffic that runs with numpy alone."""
