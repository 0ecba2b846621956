"""Scripts that measure, attack or draw the product; `python tests/measure` lists them."""
