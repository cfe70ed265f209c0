"""Contact cells: cut from outlines, and the compliance of a half space and of the pad between them."""
