"""Commands carried out by a process that has done its imports: ``ODSCEN_RESIDENT=10``.

Most of the time of a short command is Python's imports. With that variable, a command leaves behind
a process that has done them and forks one for each command that follows; it ends after so many
minutes without one. What a command does, says and writes is the same: it gets the caller's streams,
folder, arguments, environment and signals. A command whose surroundings differ in anything that
cannot be handed over (environment, limits, namespaces, Python) is not given to that process, nor is
one after a change of the sources.

Modules: :mod:`~odscen.cli.resident.surroundings` says what must be equal,
:mod:`~odscen.cli.resident.client` is the side of the command that was typed, and
:mod:`~odscen.cli.resident.server` the process that stays.
"""
