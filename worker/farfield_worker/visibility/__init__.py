"""What the eyes of a view cell can see."""
