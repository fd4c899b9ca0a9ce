"""Shortest paths over any graph of nodes, given as a matrix of lengths of its edges."""
