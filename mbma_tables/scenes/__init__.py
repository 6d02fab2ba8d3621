"""Scenes: a surface, materials, what is prescribed, and only the effects that are called for."""
