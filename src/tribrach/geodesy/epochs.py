"""Coordinates of one frame and epoch in another frame and epoch.

In a dynamic frame (any ITRF, WGS 84) marks move with their plate, two to ten centimetres a year.
Coordinates of another epoch are carried by the mark's own velocity or by a plate motion model. One
of the two must be named; nothing is assumed. First the frame changes at the epoch of the
coordinates, then the mark moves to the other epoch. ECEF in metres, epochs as decimal years,
velocities in metres per year in the frame they are carried in. Method section 1.1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from pyproj import CRS, Transformer
from pyproj.exceptions import CRSError, ProjError

from tribrach._types import Array
from tribrach.errors import InputError
from tribrach.geodesy import frames
from tribrach.sentences import Sentence

#: epochs closer than this are taken as one [years]: four days, a tenth of a millimetre
SAME_EPOCH = 0.01
#: plates of the models that come with PROJ
PLATES = (
    "AMUR", "ANTA", "ARAB", "AUST", "CARB", "EURA", "INDI", "NAZC", "NOAM", "NUBI", "PCFC",
    "SOAM", "SOMA", "SUND",
)  # fmt: skip


@dataclass(frozen=True)
class Realisation:
    """A frame by its name, such as ``ITRF2014``, and the epoch of coordinates in it."""

    frame: str  #: name of the frame, as :func:`~tribrach.geodesy.frames.frame` knows it
    epoch: float | None = None  #: decimal year; None for a frame that moves with its plate

    def __post_init__(self) -> None:
        if self.dynamic and self.epoch is None:
            raise InputError(
                f"coordinates in {self.frame} move with time and have no epoch",
                cure="give the epoch as a decimal year, such as 2005.0",
            )

    @property
    def dynamic(self) -> bool:
        """True if coordinates of marks change with time in this frame."""
        return frames.is_dynamic(self.frame)

    @property
    def words(self) -> str:
        """The frame, and its epoch if it has one."""
        return Sentence("{own.frame} at {own.epoch:2}", own=self) if self.dynamic else self.frame


@dataclass(frozen=True)
class Motion:
    """How marks move; one of the two fields is given."""

    #: (3,), of ECEF coordinates [m/year], one for all marks or one each
    velocity: Array | None = None
    plate: str | None = None  #: name of a plate of :data:`PLATES`


def carry(
    xyz: Array, source: Realisation, target: Realisation, motion: Motion | None = None
) -> tuple[Array, float]:
    """ECEF (n, 3) [m] in another frame and epoch, with the stated accuracy [m] or NaN.

    ``motion`` of the marks is needed where both frames are dynamic and the epochs differ.
    """
    if not source.dynamic:
        # plate-fixed coordinates hold at any time: the frames meet at the epoch of the target
        at = target.epoch if target.dynamic else 2000.0
        assert at is not None
        return frames.transform(xyz, source.frame, target.frame, at)
    assert source.epoch is not None
    moved, accuracy = frames.transform(xyz, source.frame, target.frame, source.epoch)
    if not target.dynamic:
        return moved, accuracy
    assert target.epoch is not None
    years = target.epoch - source.epoch
    if abs(years) <= SAME_EPOCH:
        return moved, accuracy
    if motion is None or (motion.velocity is None and motion.plate is None):
        raise InputError(
            f"coordinates in {source.words} and {target.words} are not to be mixed: marks have "
            f"moved in the {abs(years):.1f} years between",
            cure="give the velocity of the marks or their plate, or coordinates of one epoch",
        )
    if motion.velocity is not None:
        return moved + years * motion.velocity, accuracy
    assert motion.plate is not None
    return _on_plate(moved, motion.plate, target.frame, source.epoch, target.epoch), accuracy


@dataclass(frozen=True, eq=False)
class Passage:
    """The way of a file's coordinates to the frame and epoch of the job."""

    #: frames with their epochs
    source: Realisation
    target: Realisation
    #: how the marks move; needed where both frames are dynamic and the epochs differ
    motion: Motion | None = None

    def positions(self, xyz: Array) -> tuple[Array, float]:
        """ECEF coordinates (n, 3) [m] in the frame of the job, and the accuracy stated [m]."""
        return carry(xyz, self.source, self.target, self.motion)

    def turn(self, place: Array) -> tuple[Array, float]:
        """Matrix (3, 3) that takes vectors at a place to the job's frame, and accuracy [m]."""
        step = 1e5 * np.eye(3)
        around = np.concatenate([place + step, place - step])
        epoch = self.source.epoch if self.source.dynamic else self.target.epoch
        moved, accuracy = frames.transform(
            around, self.source.frame, self.target.frame, 2000.0 if epoch is None else epoch
        )
        # differences over 200 km, less those that do nothing: rounding is 1e-14
        change = (moved - around).T
        return np.eye(3) + (change[:, :3] - change[:, 3:]) / 2e5, accuracy


@cache
def crs_is_dynamic(crs: str) -> bool:
    """True if the datum of a reference system is dynamic; False where PROJ does not know it."""
    try:
        datum = CRS.from_user_input(crs).datum
    except CRSError:
        return False
    return datum is not None and "Dynamic" in datum.type_name


@cache
def plates(frame: str) -> str:
    """Name of PROJ's plate motion model for a dynamic frame.

    It is that of the frame's own realisation where there is one, else that of ITRF2014.

    ITRF2008: Altamimi et al. 2012. ITRF2014: Altamimi et al. 2017, doi 10.1093/gji/ggx136.
    ITRF2020: Altamimi et al. 2023.
    """
    name = frame.upper().replace(" ", "")
    return name if name in ("ITRF2008", "ITRF2020") else "ITRF2014"


def _on_plate(xyz: Array, plate: str, frame: str, start: float, end: float) -> Array:
    """Coordinates (n, 3) of marks after their plate has turned from epoch ``start`` to ``end``."""
    model = plates(frame)
    try:
        transformer = Transformer.from_pipeline(f"+init={model}:{plate.upper()} +t_epoch={start}")
    except ProjError as error:
        raise InputError(
            f"the plate {plate!r} is not in the motion model of {model}",
            cure=f"name one of {', '.join(PLATES)}, or give a velocity",
        ) from error
    when = np.full(len(xyz), end)
    moved = transformer.transform(xyz[:, 0], xyz[:, 1], xyz[:, 2], when, errcheck=True)
    return np.stack(moved[:3], axis=1)
