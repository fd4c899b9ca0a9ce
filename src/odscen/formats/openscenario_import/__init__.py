"""OpenSCENARIO files as scenarios, with a report on each of their elements."""
