"""Tasks of grasping: an object is taken hold of and kept."""
