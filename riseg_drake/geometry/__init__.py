"""Floor 0: pixels, pinholes, rigid motions, body frames and planes, on numpy arrays.

Conventions of the whole project, said once, here:

Frames. W world, C camera (C0 at t-1, C1 at t), E pusher tip, T table, S space frame, Q a point,
B a body frame. A camera looks along its z axis, x is right and y is down in the image.

Monogram notation. `X_AB` is the pose of B in A as a 4x4 matrix (or a pydrake RigidTransform where
pydrake is at hand), `R_AB` its rotation, `p_AQ` the point Q measured in A. `X_AC = X_AB @ X_BC`:
letters that meet must match.

Twists. `V_S = [omega; v]`, angular part first, as in the paper (eq. 1) and in Drake. A spatial twist
over one frame pair is the matrix logarithm of the motion, so its unit is radian and metre per pair.

Images. Arrays are indexed [v, u], v down and u right; pixel coordinates are written (u, v), and the
centre of the top left pixel is (0, 0). Optical flow has shape [H, W, 2] and holds (du, dv) pixels.

Depth. float32, metres along the optical axis; 0 means invalid. NaN, infinity and the 16-bit value
65535 become 0 at the door.

Units. SI throughout (metres, radians, seconds); pixels where the name or the docstring says so.
"""
