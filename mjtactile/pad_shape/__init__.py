"""What pads are shaped like: their outer surfaces, surfaces fitted to meshes, and taxels that stand anywhere."""
