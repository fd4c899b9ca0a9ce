"""What a run was planned to do and what it recorded, as values."""
