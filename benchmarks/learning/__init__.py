"""What policies learn on a fixed suite of scenes, protocol beside protocol."""
