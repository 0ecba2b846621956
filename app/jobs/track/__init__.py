"""What the tracking process does with the frames of a film, or of one chunk of it."""
