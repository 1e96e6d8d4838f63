"""Success of the built-in rules in environments and goals of users."""
