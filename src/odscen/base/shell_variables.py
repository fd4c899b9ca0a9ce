"""Variables of the environment by which a shell keeps its own books."""

OF_THE_SHELL = frozenset(("PWD", "OLDPWD", "SHLVL", "_", "COLUMNS", "LINES"))
"""Names in which commands of one shell differ, though their surroundings are the same."""
