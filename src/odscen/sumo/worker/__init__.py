"""The process of one simulation; the session in it is the only door to libsumo."""
