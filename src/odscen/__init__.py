"""odscen: traffic scenarios on OpenDRIVE maps, run headlessly in SUMO."""

__version__ = "0.2.0"
