"""HTTP in, one service call, a schema out."""
