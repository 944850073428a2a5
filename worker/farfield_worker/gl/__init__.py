"""OpenGL that the bake's renderers and `farfield shoot` share: context, textures, materials."""
