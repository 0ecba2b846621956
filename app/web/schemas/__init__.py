"""What goes over the wire, converted by hand from the services' types; a file a subject."""
