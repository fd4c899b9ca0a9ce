"""Search for critical cases: what to try next, and what has been found."""
