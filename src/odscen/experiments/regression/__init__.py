"""What pytest loads of odscen: a fixture that runs scenarios, and scenario files as tests."""
