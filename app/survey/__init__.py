"""The rules of a survey as pure functions: no database, no HTTP, no threads."""
