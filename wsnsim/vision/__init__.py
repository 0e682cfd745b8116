"""From the world to pixels and from pixels to features: renderer, photographs, colour and texture bins."""
