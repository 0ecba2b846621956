"""Places along the pipe and on its wall, and sizes between them."""
