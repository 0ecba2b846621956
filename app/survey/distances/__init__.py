"""What is stated about distances, and the distances that follow."""
