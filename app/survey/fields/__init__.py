"""The fields of a header and of an observation, declared once: name, type, bounds, and the place
that each exchange format has for them.
"""
