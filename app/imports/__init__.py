"""Readers of files that other programs, and this one, have written: bytes in, plain values out."""
