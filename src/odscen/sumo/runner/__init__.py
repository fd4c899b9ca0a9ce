"""Processes of runs, from outside: started, followed, resumed."""
