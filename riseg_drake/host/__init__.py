"""Floor 0: the machine: files and images from strangers, the terminal, processes and signals."""
