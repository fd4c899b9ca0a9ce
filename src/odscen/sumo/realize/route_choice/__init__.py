"""Which of the possible routes the trips of the demand take."""
