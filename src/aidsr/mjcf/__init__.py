"""MJCF text, from untrusted input to a checked document and a compiled model; repairs, patches and condensed forms."""
