"""Access to the server: tokens, sessions and roles."""
