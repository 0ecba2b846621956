"""What can go wrong in `vo_core`.

    ChainageError
    ├── InvalidRig           a rig file that cannot be used: names field, value, what is allowed
    │   ├── NoWallInView     its camera would see no wall, or hardly any
    │   └── RigVideoMismatch the rig's camera has pictures of another size than the video
    ├── InvalidTrack         a track file that cannot be read: names the line
    ├── InvalidCorrection    a known length or joints that do not fit the track
    ├── UndeterminedSeam     two parts of a film whose common frames do not tie their tracks
    ├── UnreadableVideo      a video that cannot be opened or that holds no decodable picture
    └── ShapeMismatch        an array whose shape or type does not fit: expected and found

What happens in normal work is a value, never an exception: a dark frame or a lost wall is an
`Estimate` with status `lost`, a file that ends early is `VideoFile.problem`.
"""

from collections.abc import Sequence


class ChainageError(Exception):
    """Base of every error that `vo_core` raises on purpose; its text is a sentence for a person."""


class InvalidRig(ChainageError):
    """The rig file is missing, is not JSON, or holds a value that is not allowed."""


class NoWallInView(InvalidRig):
    """The rig may be one, but with it the camera would see no wall, or hardly any."""


class RigVideoMismatch(InvalidRig):
    """The rig is fine, but not of the camera that made the video."""


class InvalidTrack(ChainageError):
    """A track.csv does not have the columns or the values that the contract asks for."""


class InvalidCorrection(ChainageError):
    """Known lengths or joints that cannot correct the track, or that contradict each other."""

    def __init__(self, detail: str, reason: str | None = None, **values: float | str) -> None:
        """Store the sentence and, for other languages, the name of the reason and its values."""
        super().__init__(detail)
        self.reason = reason
        self.values = values


class UndeterminedSeam(ChainageError):
    """The frames that two parts of a film have in common do not tie their tracks together."""

    def __init__(self, detail: str, part: int, lacks: Sequence[str] = ()) -> None:
        """Store the sentence, the number of the earlier part, and which of the `Traits` that it has
        seen the later one lacks.
        """
        super().__init__(detail)
        self.part = part
        self.lacks = tuple(lacks)


class UnreadableVideo(ChainageError):
    """The video is refused or gives no picture at all."""


class ShapeMismatch(ChainageError, ValueError):
    """An image has a shape, size or type that the method cannot use."""


class InvalidTime(ChainageError, ValueError):
    """A frame's time is not a finite number."""
