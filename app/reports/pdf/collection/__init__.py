"""One document over many inspections: cover, contents, list, statistics, plan, and every report."""
