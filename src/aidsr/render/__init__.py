"""Pictures and films of models, with OpenGL where there is any and ray casting where there is none."""
