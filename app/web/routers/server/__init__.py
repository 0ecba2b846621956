"""Routes of the server, of people, and of what is uploaded to it."""
