"""Many runs: sweeps, searches, studies, regression suites and datasets."""
