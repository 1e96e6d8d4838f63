"""Tasks of locomotion: the whole robot gets somewhere."""
