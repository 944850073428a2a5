"""One picture of a scene or a walk."""
