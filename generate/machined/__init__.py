"""Maps as machines make them, pressed flat by boundary elements: evidence for laws of a map."""
