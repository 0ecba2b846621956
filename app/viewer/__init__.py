"""The 3D view: one viser scene for each page, behind our own origin. The only importer of viser."""
