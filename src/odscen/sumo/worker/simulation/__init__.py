"""The running simulation: the only door to libsumo, and the hands that it gives out."""
