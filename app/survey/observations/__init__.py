"""What people record of an inspection, and its checks."""
