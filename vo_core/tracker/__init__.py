"""What the odometry keeps between frames: a class for each part, with the rules it follows."""
