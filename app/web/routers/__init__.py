"""Routes: each parses a request, calls one service and returns a schema."""
