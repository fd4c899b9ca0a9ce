"""The file before it means anything: parameters, catalogs and names put in."""
