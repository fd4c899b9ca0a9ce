"""Rules of a scenario, as the worker of a run reads them."""
