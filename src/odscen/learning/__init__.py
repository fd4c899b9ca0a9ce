"""What learns from maps and runs: generators that place traffic."""
