"""What every package shares: artifacts, roles, errors, number formats, motors."""
