"""Version of odscen: here alone, and hatchling reads it here."""

__version__ = "0.2.0"
