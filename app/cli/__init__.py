"""The command line: a module for each group of commands, which parses, calls and prints."""

import os

# Read when numpy is loaded. Its matrices are small here, and threads that wait for the next of them
# took a quarter of the processor time of `chainage track`.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
