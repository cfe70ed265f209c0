"""Contact cells: cut from outlines, how a half space answers them, and how far the pad gives under them."""
