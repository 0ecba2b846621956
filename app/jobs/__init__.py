"""Child processes: media is decoded and tracked here, never in the server."""
