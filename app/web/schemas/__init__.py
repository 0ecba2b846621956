"""The schemas of the API, converted by hand from the services' types; one file for each subject."""
