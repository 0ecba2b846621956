"""The keys of an inspection's blobs: paths below the data folder, or in an object store."""

INSPECTIONS = "inspections"
RECORDING = "recording.mkv"
"""A film that a camera is recorded into; it grows on the server's own disk."""
SAMPLE = "sample/inspection"
"""Names the sample inspection."""
INTENDED_USE = "intended-use.json"
"""How wide the interval of a distance may be before it is of no use."""

DETECTORS = "detectors"


def detector(detector_id: str) -> str:
    """Return the key of a user's model that finds defects."""
    return f"{DETECTORS}/{detector_id}.onnx"


def inspection(inspection_id: str) -> str:
    """Return the folder of an inspection."""
    return f"{INSPECTIONS}/{inspection_id}"


def film(inspection_id: str, video_file: str) -> str:
    """Return the key of a film."""
    return f"{inspection(inspection_id)}/{video_file}"


def rig(inspection_id: str) -> str:
    """Return the key of a copy of the rig; the database has the rig too."""
    return f"{inspection(inspection_id)}/rig.json"


def track(inspection_id: str) -> str:
    """Return the key of the track of an ended inspection."""
    return f"{inspection(inspection_id)}/track.csv"


def health(inspection_id: str) -> str:
    """Return the key of the picture health of an ended inspection."""
    return f"{inspection(inspection_id)}/health.csv"


def joints(inspection_id: str) -> str:
    """Return the key of the joints seen while an inspection was tracked."""
    return f"{inspection(inspection_id)}/joints.csv"


def marks(inspection_id: str) -> str:
    """Return the key of the frames missing from a recording and of where its parts begin."""
    return f"{inspection(inspection_id)}/parts.csv"


def counter(inspection_id: str) -> str:
    """Return the key of what is known of the burnt-in counter of a film."""
    return f"{inspection(inspection_id)}/counter.json"


def counter_readings(inspection_id: str) -> str:
    """Return the key of the readings of that counter."""
    return f"{inspection(inspection_id)}/counter.csv"


def wall(inspection_id: str) -> str:
    """Return the folder of the tiles of the unrolled wall."""
    return f"{inspection(inspection_id)}/wall"


def tile(inspection_id: str, index: int) -> str:
    """Return the key of a tile of the unrolled wall."""
    return f"{wall(inspection_id)}/{index}.jpg"


def runs(inspection_id: str) -> str:
    """Return the folder under which runs leave their results, each in a place of its own."""
    return f"{inspection(inspection_id)}/runs"


def photos(inspection_id: str) -> str:
    """Return the folder of the photos."""
    return f"{inspection(inspection_id)}/photos"


def photo(inspection_id: str, observation_id: str, frame: int) -> str:
    """Return the key of the photo of an observation, or of an attachment, at a frame."""
    return f"{photos(inspection_id)}/{observation_id}-{frame}.jpg"


def thumbnail(inspection_id: str, shown: str) -> str:
    """Return the key of the small picture of an inspection; it can be made again.

    Args:
        inspection_id: The inspection.
        shown: Names what it shows: another photo is another blob.
    """
    return f"{inspection(inspection_id)}/thumbnails/{shown}.jpg"


def voice(inspection_id: str, attachment_id: str, suffix: str) -> str:
    """Return the key of a voice note; the suffix begins with a dot."""
    return f"{inspection(inspection_id)}/voice/{attachment_id}{suffix}"


def clip(inspection_id: str, observation_id: str, frame: int, film_sha256: str) -> str:
    """Return the key of the clip around an observation at a frame; it can be made again.

    A recording that was continued is another film: a clip at its old end lacks what came then.
    """
    name = f"{observation_id}-{frame}-{film_sha256[:16]}.mp4"
    return f"{inspection(inspection_id)}/clips/{name}"


def changes(inspection_id: str) -> str:
    """Return the folder of the comparisons with earlier inspections; they can be made again."""
    return f"{inspection(inspection_id)}/changes"


def changes_since(inspection_id: str, earlier_id: str) -> str:
    """Return the key of the comparison with an earlier inspection."""
    return f"{changes(inspection_id)}/{earlier_id}.json"
