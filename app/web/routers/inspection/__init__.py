"""Routes of one inspection, and the list of them."""
