"""Attacks on every command: kills, hostile servers, documents and replies, foreign folders, requests."""
