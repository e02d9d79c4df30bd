"""Every posture that brings the Panda's flange to a pose: closed form, with joint 7 as the free angle.

Seven joints leave one freedom for a given pose of the flange F. Fixing q7 settles joint 6's axis, and
what is left is elementary: shoulder S, elbow and wrist form a triangle with two known sides, which gives
q4; the forearm's axis lies on a cone about the line from wrist to shoulder and stands upright on joint
6's axis, which gives up to two elbows; the shoulder's three axes meet in S and give two postures each.
(The choice of q7 as the free angle is that of He and Liu, "Analytical inverse kinematics for Franka
Emika Panda", ICMCSR 2021; the derivation here is by vectors.)
"""

import numpy as np
from numpy.typing import NDArray

BASE_TO_SHOULDER = 0.333
UPPER_ARM = 0.316
ELBOW = 0.0825
FOREARM = 0.384
WRIST = 0.088
FLANGE = 0.107
"""Published joint offsets of the arm, m (Denavit-Hartenberg parameters, Franka Control Interface)."""

_UPPER_SIDE = np.hypot(UPPER_ARM, ELBOW)
_FORE_SIDE = np.hypot(FOREARM, ELBOW)
# Angle at the elbow between the two sides of the triangle when q4 = 0, seen from the inside of the bend.
_ELBOW_OFFSET = np.arctan2(UPPER_ARM, ELBOW) + np.arctan2(FOREARM, ELBOW)


def panda_postures(X_WF: NDArray, q7: NDArray) -> NDArray[np.float64]:
    """All postures [N, 7] that bring the flange to X_WF [4, 4], for each of the given q7 [M]; N <= 4 M.

    The base stands at W. Angles lie in (-pi, pi] (q6 in (-pi/2, 3 pi/2]); limits of the joints are not
    looked at. A pose out of reach gives an empty array.
    """
    q7 = np.atleast_1d(np.asarray(q7, np.float64))
    x_F, y_F, z_F = X_WF[:3, 0], X_WF[:3, 1], X_WF[:3, 2]
    # Joint 6 from q7: R_67 = Rx(90 deg) Rz(q7), so x_6 = Rz(-q7) x_7 and z_6 = y of that frame.
    c7, s7 = np.cos(q7)[:, None], np.sin(q7)[:, None]
    x_6 = c7 * x_F - s7 * y_F
    z_6 = s7 * x_F + c7 * y_F
    p_WWrist = X_WF[:3, 3] - FLANGE * z_F - WRIST * x_6
    p_SWrist = p_WWrist - [0, 0, BASE_TO_SHOULDER]
    distance = np.linalg.norm(p_SWrist, axis=1)
    # Law of cosines, at the elbow and at the wrist.
    cos_elbow = (_UPPER_SIDE**2 + _FORE_SIDE**2 - distance**2) / (2 * _UPPER_SIDE * _FORE_SIDE)
    cos_wrist = (distance**2 + _FORE_SIDE**2 - _UPPER_SIDE**2) / (2 * distance * _FORE_SIDE)
    reachable = (np.abs(cos_elbow) <= 1) & (np.abs(cos_wrist) <= 1)
    elbow = np.arccos(np.clip(cos_elbow, -1, 1))
    q4 = elbow + _ELBOW_OFFSET - 2 * np.pi
    # The forearm's axis z_5 leaves the wrist at this angle from the line shoulder -> wrist.
    cone = np.arccos(np.clip(cos_wrist, -1, 1)) + np.arctan2(ELBOW, FOREARM)

    # z_5 = cos(cone) line + sin(cone) (cos(phi) across + sin(phi) beside), upright on z_6.
    line = p_SWrist / distance[:, None]
    along = np.einsum("ij,ij->i", line, z_6)
    across = z_6 - along[:, None] * line
    across_norm = np.linalg.norm(across, axis=1)
    across /= np.maximum(across_norm, 1e-12)[:, None]
    beside = np.cross(line, across)
    cos_phi = -np.cos(cone) * along / np.maximum(np.sin(cone) * across_norm, 1e-12)
    reachable &= np.abs(cos_phi) <= 1
    phi = np.arccos(np.clip(cos_phi, -1, 1))

    solutions = []
    for side in (1, -1):
        outward = np.cos(phi)[:, None] * across + side * np.sin(phi)[:, None] * beside
        z_5 = np.cos(cone)[:, None] * line + np.sin(cone)[:, None] * outward
        # x_4 points from the elbow joint to the side of the forearm that is away from its axis.
        x_4 = np.cos(cone)[:, None] * outward - np.sin(cone)[:, None] * line
        R_W4 = np.stack([x_4, z_5, np.cross(x_4, z_5)], axis=-1)
        solutions += _shoulder_and_wrist(R_W4, q4, x_6, z_6, q7, reachable)
    return np.concatenate(solutions)


def _shoulder_and_wrist(
    R_W4: NDArray, q4: NDArray, x_6: NDArray, z_6: NDArray, q7: NDArray, reachable: NDArray
) -> list[NDArray]:
    """The two postures of the shoulder for a known frame 4, each [N, 7] without unreachable rows."""
    # Joint 5 turns about y_4, R_45 = Rx(-90 deg) Rz(q5); joint 6: R_56 = Rx(90 deg) Rz(q6), z_6 = -y_5.
    z_6_in_4 = np.einsum("nji,nj->ni", R_W4, z_6)
    q5 = np.arctan2(z_6_in_4[:, 0], z_6_in_4[:, 2])
    x_5 = np.cos(q5)[:, None] * R_W4[:, :, 0] - np.sin(q5)[:, None] * R_W4[:, :, 2]
    q6 = np.arctan2(np.einsum("ij,ij->i", x_6, R_W4[:, :, 1]), np.einsum("ij,ij->i", x_6, x_5))
    q6 = np.where(q6 <= -np.pi / 2, q6 + 2 * np.pi, q6)
    # Frame 3 from R_34 = Rx(90 deg) Rz(q4).
    c4, s4 = np.cos(q4)[:, None], np.sin(q4)[:, None]
    x_3 = c4 * R_W4[:, :, 0] - s4 * R_W4[:, :, 1]
    z_3 = s4 * R_W4[:, :, 0] + c4 * R_W4[:, :, 1]
    y_3 = np.cross(z_3, x_3)
    # R_W3 = Rz(q1) Ry(q2) Rz(q3): Euler angles of the shoulder.
    postures = []
    for sign in (1, -1):
        q2 = sign * np.arccos(np.clip(z_3[:, 2], -1, 1))
        q1 = np.arctan2(sign * z_3[:, 1], sign * z_3[:, 0])
        q3 = np.arctan2(sign * y_3[:, 2], -sign * x_3[:, 2])
        postures.append(np.stack([q1, q2, q3, q4, q5, q6, q7], axis=-1)[reachable])
    return postures
