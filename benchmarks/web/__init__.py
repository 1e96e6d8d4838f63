"""Measurements of the web app."""
