"""Drake systems: thin doorways to the functions of the floors below."""
