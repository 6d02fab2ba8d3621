"""What a designer asks: joints, scenes, sensitivities."""
