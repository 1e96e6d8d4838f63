"""MJCF text: parsing and checking of untrusted input, compilation, editing, import of files, and condensed forms."""
