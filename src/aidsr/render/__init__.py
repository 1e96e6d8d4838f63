"""Pictures and videos of models, by OpenGL if available and else by ray casting."""
