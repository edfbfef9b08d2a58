"""Open3D: points to planes from the approximate poses, and its information matrix."""

import numpy as np
import open3d

from benchmarks.coverage.programs import Found
from benchmarks.coverage.scenes import Scene
from benchmarks.coverage.world import Array

SETTINGS = (
    f"Open3D {open3d.__version__}, ICP to planes on a grid of 0.05 m from the approximate poses; "
    "inverse of its information matrix times the mean square of the distances"
)
_REGISTRATION = open3d.pipelines.registration


def cloud(points: Array) -> "open3d.geometry.PointCloud":
    """Points with normals."""
    out = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))
    out = out.voxel_down_sample(0.05)
    out.estimate_normals(open3d.geometry.KDTreeSearchParamHybrid(radius=0.6, max_nn=20))
    return out


def register(scene: Scene) -> dict[str, Found | str]:
    """Each scan by itself."""
    first, out = cloud(scene.points(scene.scans[0])), dict[str, Found | str]()
    for scan in scene.scans[1:]:
        other, pose = cloud(scene.points(scan)), scene.approximate(scan)
        way = _REGISTRATION.TransformationEstimationPointToPlane(_REGISTRATION.TukeyLoss(k=0.1))
        for reach in (1.0, 0.3, 0.1):
            enough = _REGISTRATION.ICPConvergenceCriteria(1e-9, 1e-9, 100)
            found = _REGISTRATION.registration_icp(other, first, reach, pose, way, enough)
            pose = found.transformation
        known = _REGISTRATION.get_information_matrix_from_point_clouds(other, first, reach, pose)
        if found.fitness < 0.05 or np.linalg.matrix_rank(known) < 6:
            out[scan] = "too few points lie on the first scan"
            continue
        # its increments turn the scan about the origin of the first: turn, then shift
        x, y, z = pose[:3, 3]
        change = np.zeros((6, 6))
        change[:3, :3] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
        change[:3, 3:] = change[3:, :3] = np.eye(3)
        covariance = found.inlier_rmse**2 * change @ np.linalg.inv(known) @ change.T
        out[scan] = Found(np.array(pose), (covariance + covariance.T) / 2)
    return out
