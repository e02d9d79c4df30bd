import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw
from scipy.spatial.transform import Rotation

from riseg_drake.export.poses import write_poses
from riseg_drake.segmentation.displacements import Displacements

TURN = RigidTransform(RollPitchYaw(0, 0, 0.3), [0, 0, 0])
ABOUT = RigidTransform([0.4, -0.1, 0.05])
"""Where the object is."""


def known():
    displacements = Displacements()
    shift = RigidTransform([0.02, 0.01, 0])
    turned = ABOUT @ shift @ TURN @ ABOUT.inverse()
    displacements.tracks[7] = {0.5: np.eye(4), 2.25: turned.GetAsMatrix4()}
    displacements.middle[7] = ABOUT.translation()
    return displacements


def test_a_line_is_the_time_and_how_far_the_middle_of_the_object_went_and_how_it_turned(tmp_path):
    write_poses(tmp_path, known(), [7])
    stamps, p, q = np.split(np.loadtxt(tmp_path / "object_7.txt"), [1, 4], axis=1)
    assert stamps.ravel().tolist() == [0.5, 2.25]
    np.testing.assert_allclose(p, [[0, 0, 0], [0.02, 0.01, 0]], atol=1e-15)
    np.testing.assert_allclose(Rotation.from_quat(q).as_rotvec(), [[0, 0, 0], [0, 0, 0.3]], atol=1e-12)
    assert "p_WB of the first line: 0.4 -0.1 0.05;" in (tmp_path / "object_7.txt").read_text()


def test_an_id_without_a_known_motion_has_no_file_and_a_line_that_says_so(tmp_path):
    folder = tmp_path / "poses"
    notes = write_poses(folder, known(), [9])
    assert notes == ["poses: no file for object 9: the segmentation knows no motion of it"]
    assert not folder.exists()
