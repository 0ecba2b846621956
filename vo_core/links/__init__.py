"""Links: a picture measured against another one, with all motions that may explain it."""
