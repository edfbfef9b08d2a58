"""Places and poses in space: scanners, GNSS vectors, relative poses, planes.

``x = R u + t`` carries scanner coordinates u into the frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tribrach._types import Array, Index
from tribrach.geometry.alignment import Groups, group_rigid
from tribrach.network.start.frame import Frame
from tribrach.network.start.grouping import grouped_median, wrap


def placed_poses(f: Frame) -> NDArray[np.bool_]:
    """Poses (S,) whose position and rotation are known."""
    nodes = slice(f.ties.n_points, f.ties.n_positions)
    out: NDArray[np.bool_] = f.known[nodes] & np.isfinite(f.turn[:, 0, 0])
    return out


def fixes(f: Frame) -> None:
    """Observed coordinates."""
    if f.kind != "world":
        return
    node, xyz = f.ties.fixes.node, f.ties.fixes.xyz
    for axis in range(2):
        rows = np.isfinite(xyz[:, axis]) & np.isnan(f.plan[node, axis])
        keys, medians, _ = grouped_median(node[rows], xyz[rows, axis, None])
        f.plan[keys, axis] = medians[:, 0]
    rows = np.isfinite(xyz[:, 2]) & np.isnan(f.up[node])
    f.place_up(node[rows], f.heights(xyz[rows]))


def vectors(f: Frame) -> None:
    """Places at either end of coordinate differences."""
    if f.kind not in ("world", "oriented"):
        return
    v, known = f.ties.vectors, f.known
    for at, to, sign in ((v.start, v.end, 1.0), (v.end, v.start, -1.0)):
        rows = known[at] & ~known[to]
        if rows.any():
            f.place(to[rows], f.space(at[rows]) + sign * v.value[rows])


def shots(f: Frame) -> None:
    """Targets seen from placed scanners."""
    s, placed = f.shots, placed_poses(f)
    s = s[placed[s.pose] & ~f.known[s.target]]
    if len(s):
        turned = np.einsum("nij,nj->ni", f.turn[s.pose], s.u)
        f.place(s.target, f.space(f.ties.pose_node(s.pose)) + turned)


def poses(f: Frame) -> None:
    """Scanners that see three or more known targets (or whose rotation is known, one)."""
    s, placed, known = f.shots, placed_poses(f), f.known
    s = s[~placed[s.pose] & known[s.target]]
    # a scanner whose own place is known sees itself at zero
    own = np.unique(s.pose)
    own = own[known[f.ties.pose_node(own)]]
    pose = np.concatenate([s.pose, own])
    world = f.space(np.concatenate([s.target, f.ties.pose_node(own)]))
    local = np.concatenate([s.u, np.zeros((len(own), 3))])
    turned = np.isfinite(f.turn[pose, 0, 0])
    if turned.any():
        rotated = np.einsum("nij,nj->ni", f.turn[pose[turned]], local[turned])
        f.place(f.ties.pose_node(pose[turned]), world[turned] - rotated)
        pose, local, world = pose[~turned], local[~turned], world[~turned]
    if len(pose) == 0:
        return
    numbers, group = np.unique(pose, return_inverse=True)
    fit, rms = robust_rigid(group, len(numbers), local, world)
    # three targets close together would swing the rest of a scan about
    reach = _reach(f, numbers)
    narrow = 1e-3 if f.relaxed else 0.1
    good = (fit.count >= 3) & (fit.spread > np.maximum(narrow * reach, 1e-3))
    good &= rms < (0.3 if f.relaxed else 0.1) * fit.spread
    f.turn[numbers[good]] = fit.rotation[good]
    f.place(f.ties.pose_node(numbers[good]), fit.translation[good])


def _reach(f: Frame, numbers: Index) -> Array:
    """Root mean square distance (n,) of all targets of some poses from the scanner."""
    s = f.ties.shots
    size = len(f.turn)
    square = np.bincount(s.pose, (s.u**2).sum(axis=1), minlength=size)
    return np.sqrt(square / np.maximum(np.bincount(s.pose, minlength=size), 1))[numbers]


def robust_rigid(group: Index, size: int, local: Array, world: Array) -> tuple[Groups, Array]:
    """Align groups of pairs of points rigidly, the majority deciding.

    Weights ``1 / (|v| + median |v|)`` let the majority decide (iteratively, as for a sum of
    absolute residuals).

    ``group`` (n,): number of the group of each pair; ``local``, ``world`` (n, 3): the pairs [m].
    Returns (size,): median of its residuals [m].
    """
    fit = group_rigid(group, size, local, world)
    medians = np.zeros(size)
    for _ in range(5):
        v = np.linalg.norm(fit.residuals(group, local, world), axis=1)
        keys, median, _ = grouped_median(group, v[:, None])
        medians[keys] = median[:, 0]
        if not (v > 4 * medians[group] + 1e-6).any():
            break
        weights = 1 / (v + medians[group] + 1e-9)
        fit = group_rigid(group, size, local, world, weights)
    return fit, medians


def headings(f: Frame) -> None:
    """Levelled scanners: rotation from orientation, and orientation from rotation."""
    numbers = np.flatnonzero(f.ties.levelled & f.open_pose)
    sets, nodes = f.ties.pose_set(numbers), f.ties.pose_node(numbers)
    has_turn, has_set = np.isfinite(f.turn[numbers, 0, 0]), np.isfinite(f.orientation[sets])
    new = has_set & ~has_turn & f.known_plan[nodes]
    o = f.orientation[sets[new]]
    turn = np.zeros((len(o), 3, 3))
    turn[:, 0, 0], turn[:, 0, 1] = np.cos(o), np.sin(o)
    turn[:, 1, 0], turn[:, 1, 1] = -np.sin(o), np.cos(o)
    turn[:, 2, 2] = 1.0
    upright = f.upright(nodes[new]).transpose(0, 2, 1)
    f.turn[numbers[new]] = upright @ turn @ f.ties.levelling[numbers[new]]
    new = has_turn & ~has_set
    level = f.upright(nodes[new]) @ f.turn[numbers[new]]
    level = level @ f.ties.levelling[numbers[new]].transpose(0, 2, 1)
    f.orientation[sets[new]] = wrap(np.arctan2(level[:, 0, 1], level[:, 0, 0]))


def links(f: Frame) -> None:
    """Poses from poses they were registered to."""
    k, placed = f.ties.links, placed_poses(f)
    k = k[f.open_pose[k.first] & f.open_pose[k.second]]
    ahead = np.flatnonzero(placed[k.first] & ~placed[k.second])
    back = np.flatnonzero(placed[k.second] & ~placed[k.first])
    if len(ahead):
        i = k.first[ahead]
        t = f.space(f.ties.pose_node(i)) + np.einsum("nij,nj->ni", f.turn[i], k.shift[ahead])
        f.turn[k.second[ahead]] = f.turn[i] @ k.turn[ahead]
        f.place(f.ties.pose_node(k.second[ahead]), t)
    if len(back):
        j, i = k.second[back], k.first[back]
        turn = f.turn[j] @ k.turn[back].transpose(0, 2, 1)
        t = f.space(f.ties.pose_node(j)) - np.einsum("nij,nj->ni", turn, k.shift[back])
        f.turn[i] = turn
        f.place(f.ties.pose_node(i), t)


def faces(f: Frame) -> None:
    """Planes seen from placed scanners, then scanners that see three known planes."""
    p, placed = f.ties.faces, placed_poses(f)
    p = p[f.open_pose[p.pose]]
    seen = p[placed[p.pose] & np.isnan(f.offset[p.plane])]
    if len(seen):
        normal = np.einsum("nij,nj->ni", f.turn[seen.pose], seen.normal)
        t = f.space(f.ties.pose_node(seen.pose))
        planes, first = np.unique(seen.plane, return_index=True)
        f.normal[planes] = normal[first]
        f.offset[planes] = (seen.offset + np.einsum("ni,ni->n", normal, t))[first]
    rest = p[~placed[p.pose] & np.isfinite(f.offset[p.plane])]
    for pose in np.unique(rest.pose):
        _pose_by_planes(f, int(pose))


def _pose_by_planes(f: Frame, pose: int) -> None:
    """Rotation from normals, translation from offsets: ``n . t = d - d_s``."""
    p = f.ties.faces
    p = p[(p.pose == pose) & np.isfinite(f.offset[p.plane])]
    normals = f.normal[p.plane]
    strength = np.linalg.svd(normals, compute_uv=False)
    if len(strength) < 3 or strength[2] < 0.1:
        return
    u, _, vt = np.linalg.svd(normals.T @ p.normal)
    turn = u @ np.diag([1.0, 1.0, np.linalg.det(u) * np.linalg.det(vt)]) @ vt
    t: Array = np.linalg.pinv(normals) @ (f.offset[p.plane] - p.offset)
    f.turn[pose] = turn
    f.place(f.ties.pose_node(np.array([pose])), t[None])
