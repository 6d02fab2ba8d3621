"""What a designer asks: joints, scenes, derivatives, uncertainty."""
