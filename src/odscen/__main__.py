"""``python -m odscen``."""

from odscen.cli import main

main()
