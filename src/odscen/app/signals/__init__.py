"""What people do with traffic lights."""
