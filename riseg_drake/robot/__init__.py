"""Robot: description, forward kinematics, and the pixels that the robot itself covers."""
