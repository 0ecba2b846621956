"""The 3D view: one viser scene an inspection, behind our own origin. The only importer of viser."""
