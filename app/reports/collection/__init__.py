"""What a document over many inspections says of all of them: list, statistics, plan."""
