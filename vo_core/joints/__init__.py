"""Pipe joints: detects rings on the wall, and decides which of them are joints."""
