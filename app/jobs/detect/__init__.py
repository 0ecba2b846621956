"""Runs the models of users; only for a child process with limits: nobody has checked the files."""
