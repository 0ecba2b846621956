"""One camera: captured, recorded and tracked in a child process of its own."""
