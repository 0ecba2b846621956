"""Text that is burnt into the pictures of a film, above all the distance counter."""
