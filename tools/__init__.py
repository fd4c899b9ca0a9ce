"""Maintainers' scripts; odscen itself never imports them."""
