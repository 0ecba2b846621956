"""Films of inspections: uploaded, recorded, rendered; their first pictures, and what they show."""
