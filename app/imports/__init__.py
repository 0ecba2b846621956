"""Readers of files written by other programs and by this one: bytes in, plain values out."""
