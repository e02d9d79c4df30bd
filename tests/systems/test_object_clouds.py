from dataclasses import replace

import numpy as np
from pydrake.common.value import AbstractValue
from pydrake.math import RigidTransform
from pydrake.systems.sensors import CameraInfo, ImageLabel16I

from riseg_drake.geometry.rgbd import NO_FRAME
from riseg_drake.segmentation.propagation import UNKNOWN
from riseg_drake.segmentation.segmentation import Segmentation, nothing_segmented
from riseg_drake.systems.object_clouds import ObjectClouds
from tests.export.segmented_frames import CAMERA, FRAMES

SHOWN = FRAMES[3]


def outputs(segmentation):
    system = ObjectClouds(CAMERA)
    context = system.CreateDefaultContext()
    system.GetInputPort("segmentation").FixValue(context, AbstractValue.Make(segmentation))
    return (system.GetOutputPort(name).Eval(context) for name in ("label_image", "object_clouds"))


def seen():
    frame = replace(
        NO_FRAME, sequence=0, intrinsics=CAMERA, color=SHOWN.color, depth=SHOWN.depth, X_WC=SHOWN.X_WC
    )
    return Segmentation(0, np.where(SHOWN.mask > 0, SHOWN.mask, UNKNOWN), seen=frame)


def test_the_label_image_of_drake_is_the_mask_and_what_has_not_moved_is_background():
    image, _ = outputs(seen())
    assert isinstance(image, ImageLabel16I)
    np.testing.assert_array_equal(image.data[..., 0], SHOWN.mask)


def test_the_cloud_of_an_object_projects_by_drakes_camera_into_its_very_pixels():
    _, clouds = outputs(seen())
    assert sorted(clouds) == [2, 300]
    camera = CameraInfo(CAMERA.width, CAMERA.height, CAMERA.fx, CAMERA.fy, CAMERA.cx, CAMERA.cy)
    X_WC = RigidTransform(SHOWN.X_WC)
    for object_id, cloud in clouds.items():
        p_CQ = X_WC.inverse().multiply(cloud.xyzs().astype(float))
        uvz = camera.intrinsic_matrix() @ p_CQ
        u, v = np.rint(uvz[:2] / uvz[2]).astype(int)
        drawn = np.zeros(SHOWN.mask.shape, bool)
        drawn[v, u] = True
        np.testing.assert_array_equal(drawn, (SHOWN.mask == object_id) & (SHOWN.depth > 0))
        np.testing.assert_array_equal(cloud.rgbs().T, SHOWN.color[v, u])
        np.testing.assert_allclose(p_CQ[2], SHOWN.depth[v, u], atol=1e-6)


def test_before_the_first_frame_there_is_an_empty_image_and_no_cloud():
    image, clouds = outputs(nothing_segmented(CAMERA.shape))
    assert not image.data.any()
    assert clouds == {}
