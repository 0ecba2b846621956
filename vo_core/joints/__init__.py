"""Pipe joints: rings on the wall, and which of them are joints."""
