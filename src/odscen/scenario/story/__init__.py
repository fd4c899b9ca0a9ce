"""Rules as they run: conditions, actions and their registries; numbers in, numbers out."""
