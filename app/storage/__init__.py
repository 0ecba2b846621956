"""The only part that knows SQL and paths: the database and the files of the data folder."""
