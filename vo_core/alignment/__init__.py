"""Two unrolled walls of one pipe in register: which place of one is which place of the other."""
