"""Models of the arm, the wrist camera, the pusher, the table and the objects, as files."""
