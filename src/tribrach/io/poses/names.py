"""Names of the files of poses that stand beside clouds."""

from __future__ import annotations

#: placements of all scans, and a table of them
POSES, POSES_TABLE = "poses.json", "poses.csv"
#: joint covariance of the stations and of what the points share
JOINT = "poses_covariance.npy"
#: what the rows of the joint covariance have to do with given values: their covariance with these,
#: and below it that of the given values
GIVEN = "poses_given.npy"
#: all of them
POSE_FILES = (POSES, POSES_TABLE, JOINT, GIVEN)
