"""What the built-in rules reach with environments and goals of one's own."""
