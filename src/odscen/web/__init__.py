"""The server of the page: maps, scenarios and runs over HTTP, running simulations over WebSocket.

It asks and tells; every rule is :mod:`odscen.scenario`'s. libsumo is never imported here: each run
is a process of its own.
"""
