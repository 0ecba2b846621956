"""Notifications that must not wait."""
