"""Who may enter, and in which role."""
