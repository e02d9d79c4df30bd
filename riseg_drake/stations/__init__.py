"""One contract of ports, and the stations that stand behind it."""
