"""Definitions shared by all packages: artifacts, roles, errors, number formats, motors."""
