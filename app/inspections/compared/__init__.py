"""Two surveys of one asset: their walls in register, and what follows from it."""
