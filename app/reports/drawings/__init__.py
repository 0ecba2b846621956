"""Every drawing of the reports, once: an SVG that the PDF places and the page contains."""
