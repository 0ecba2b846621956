"""What the reports for people have in common: words, axis, placement of labels."""
