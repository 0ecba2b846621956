"""Child processes that answer single requests about films and files."""
