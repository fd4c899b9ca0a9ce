"""What people do with learned traffic: data for it, training, and its measurement."""
