"""Glass, sensor and recorder: from the light on the sensor to the pictures of a film."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from app.lab.simulation.camera import FloatImage
from app.lab.simulation.scenario import Scenario
from app.lab.simulation.time_stamps import row_delays_s

_BLACK_GREY = 4.0
_PUMPING_PERIOD_S = 5.0

_SKID = ((0.12, 1.0), (0.2, 0.86), (0.42, 0.83), (0.58, 0.83), (0.8, 0.86), (0.88, 1.0))
"""Corners of the robot's parts as shares of width and height of the picture; so are the next."""
_LAMP_FRAME = ((1.0, 0.0), (0.8, 0.0), (0.83, 0.07), (0.92, 0.2), (1.0, 0.24))

_MIST_GREY = 110.0
"""Grey level of mist in full light."""
_MIST_PX_S = ((25.0, 7.0), (-13.0, 11.0))
"""How fast its two layers of clouds drift to the right and down, in pixels of 640."""
_MIST_CELL_PX = 20

_CABLE_GREY = 70.0
_CABLE_HZ = 0.7
_CROP_HZ = (0.9, 1.3)
"""How often the crop of a stabiliser goes to and fro across and down."""


class Recorder:
    """Glass, sensor and recorder, which turn the light into a stored picture."""

    def __init__(self, scenario: Scenario, frames: int) -> None:
        self._scenario = scenario
        self._rng = np.random.default_rng([scenario.seed, 1, scenario.noise_draw])
        camera = scenario.rendered_rig.camera
        self._noise = np.empty((camera.height, camera.width), np.float32)
        self._dirt = _dirt(scenario) if scenario.dirt_share else None
        self._parts = _parts(scenario) if scenario.parts else None
        self._clouds = _clouds(scenario) if scenario.mist else None
        self._row_delays_s = np.array(row_delays_s(scenario))[:, None]
        self._faults = _drop_outs(scenario, frames)
        self._last: NDArray[np.uint8] | None = None

    def record(self, index: int, light: FloatImage) -> NDArray[np.uint8]:
        """Record the picture of one frame."""
        gain = float(np.clip(1 + self._scenario.flicker * self._rng.standard_normal(), 0.45, 1.7))
        t_s = index / self._scenario.camera_frames_per_s
        gain *= _exposure(self._scenario, t_s)
        self._rng.standard_normal(out=self._noise, dtype=np.float32)
        fault = self._faults.get(index)
        if fault == "frozen" and self._last is not None:
            return self._last
        if fault == "black":
            light = np.zeros_like(light)
        elif self._dirt is not None:
            clear, veil = self._dirt
            haze = cv2.blur(cv2.resize(light, None, fx=0.125, fy=0.125), (15, 15))
            light = light * clear
            light += veil * cv2.resize(haze, light.shape[::-1])
        light = self._spoilt(light, t_s)
        if self._parts is not None and fault != "black":
            cover, grey = self._parts
            light = light * (1 - cover)
            light += cover * grey
        grey = self._noise * np.float32(self._scenario.noise_grey)
        grey += light * np.float32(gain)
        grey += np.float32(_BLACK_GREY + 0.5)
        image = np.clip(grey, 0, 255, out=grey).astype(np.uint8)
        if self._scenario.text:
            _burn_in(image, t_s)
        self._last = image
        return image

    def _spoilt(self, light: FloatImage, t_s: float) -> FloatImage:
        """Change the light by a pulsed lamp, mist, a cable and a crop that moves."""
        scenario = self._scenario
        if scenario.pulse is not None:
            light = light * scenario.pulse.gain(t_s + self._row_delays_s)
        if self._clouds is not None:
            share = scenario.mist * _drifted(self._clouds, light.shape, t_s)
            light = light * (1 - share)
            light += share * np.float32(_MIST_GREY * scenario.brightness)
        if scenario.cable:
            light = np.where(_cable(light.shape, t_s), np.float32(_CABLE_GREY), light)
        if scenario.crop_px:
            du, dv = (scenario.crop_px * np.sin(2 * np.pi * hz * t_s) for hz in _CROP_HZ)
            shift = np.array([[1, 0, du], [0, 1, dv]])
            light = np.asarray(
                cv2.warpAffine(light, shift, light.shape[::-1], borderMode=cv2.BORDER_REFLECT_101),
                np.float32,
            )
        return light


def _clouds(scenario: Scenario) -> FloatImage:
    """A coarse square of smooth noise of unit variance that repeats seamlessly."""
    rng = np.random.default_rng([scenario.seed, 7])
    size = 64
    r = np.hypot(*np.meshgrid(np.fft.fftfreq(size), np.fft.rfftfreq(size), indexing="ij"))
    spectrum = np.fft.rfft2(rng.standard_normal((size, size))) * np.exp(-0.5 * (r / 0.08) ** 2)
    clouds = np.fft.irfft2(spectrum)
    return np.asarray((clouds - clouds.mean()) / clouds.std(), np.float32)


def _drifted(clouds: FloatImage, shape: tuple[int, ...], t_s: float) -> FloatImage:
    """Two layers of clouds that drift, (H, W) in 0 to 1."""
    height, width = shape
    cell_px = _MIST_CELL_PX * width / 640
    u, v = np.meshgrid(
        np.arange(-1, width / cell_px + 2, dtype=np.float32),
        np.arange(-1, height / cell_px + 2, dtype=np.float32),
    )
    density = np.full(u.shape, 0.5, np.float32)
    for turn, (across, down) in enumerate(_MIST_PX_S):
        columns, rows = (
            u - np.float32(across * t_s / _MIST_CELL_PX + 31 * turn),
            v - np.float32(down * t_s / _MIST_CELL_PX),
        )
        layer = cv2.remap(clouds, columns, rows, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
        density += np.float32(0.2) * layer
    fine = cv2.resize(density, None, fx=cell_px, fy=cell_px, interpolation=cv2.INTER_CUBIC)
    edge = round(cell_px)
    return np.clip(fine[edge : edge + height, edge : edge + width], 0, 1)


def _cable(shape: tuple[int, ...], t_s: float) -> NDArray[np.bool_]:
    """(H, W) where a cable hides the picture, which hangs from above and swings."""
    height, width = shape
    hangs = np.linspace(0, 0.7, 20)
    swing = 0.15 * np.sin(2 * np.pi * _CABLE_HZ * t_s - hangs)
    corners = np.stack([(0.62 + swing * hangs) * width, hangs * height], axis=-1)
    cover = np.zeros(shape, np.uint8)
    thick = max(2, round(0.022 * width))
    cv2.polylines(cover, [np.rint(corners).astype(np.int32)], False, 1, thick)
    return cover > 0


def _exposure(scenario: Scenario, t_s: float) -> float:
    """Exposure around 1, a slow wave of its logarithm."""
    return float(scenario.pumping ** (np.sin(2 * np.pi * t_s / _PUMPING_PERIOD_S) / 2))


def _parts(scenario: Scenario) -> tuple[FloatImage, FloatImage]:
    """(H, W) cover of the robot's own parts, and their light, which is that of the fixed lamp."""
    rng = np.random.default_rng([scenario.seed, 6])
    camera = scenario.rendered_rig.camera
    shape = (camera.height, camera.width)
    hidden = np.zeros(shape, np.float32)
    for outline in (_SKID, _LAMP_FRAME):
        corners = np.rint(np.array(outline) * (camera.width, camera.height)).astype(np.int32)
        cv2.fillPoly(hidden, [corners], 1.0)
    cover = cv2.GaussianBlur(hidden, (0, 0), 1.5)  # they stand too near to be in focus
    scratches = cv2.GaussianBlur(rng.standard_normal(shape).astype(np.float32), (0, 0), 2.5)
    shine = np.linspace(40, 90, camera.height, dtype=np.float32)[:, None]
    return np.asarray(cover, np.float32), np.asarray(shine * (1 + 0.8 * scratches), np.float32)


def _dirt(scenario: Scenario) -> tuple[FloatImage, FloatImage]:
    """(H, W) transmission of the glass, and share of the surrounding light it scatters."""
    rng = np.random.default_rng([scenario.seed, 2])
    camera = scenario.rendered_rig.camera
    shape = (camera.height, camera.width)
    cover = np.zeros(shape, np.float32)
    while float((cover > 0.5).mean()) < scenario.dirt_share:
        blob = np.zeros(shape, np.float32)
        centre = rng.uniform((0, 0), (camera.width, camera.height))
        radius = min(float(rng.lognormal(np.log(0.02), 0.8)), 0.09) * camera.width
        axes = (max(2, round(radius)), max(2, round(radius * rng.uniform(0.5, 1))))
        cv2.ellipse(
            blob,
            (round(centre[0]), round(centre[1])),
            axes,
            float(rng.uniform(0, 180)),
            0,
            360,
            float(rng.uniform(0.6, 0.95)),
            -1,
        )
        cover = np.maximum(cover, cv2.GaussianBlur(blob, (0, 0), 1.0 + radius * 0.12))
    streaks = rng.standard_normal((camera.height // 40 + 2, camera.width // 40 + 2))
    haze = cv2.resize(streaks.astype(np.float32), shape[::-1], interpolation=cv2.INTER_CUBIC)
    haze = np.clip(0.1 + 0.04 * haze, 0, 0.3)
    grain = cv2.GaussianBlur(rng.standard_normal(shape).astype(np.float32), (0, 0), 1.2)
    veil = haze + cover * np.clip(0.3 + 0.4 * grain, 0, 0.6)
    return (1 - cover) * (1 - haze), veil.astype(np.float32)


def _drop_outs(scenario: Scenario, frames: int) -> dict[int, str]:
    """Frames that are "black" or "frozen", by number."""
    faults: dict[int, str] = {}
    if not scenario.drop_out_frames:
        return faults
    rng = np.random.default_rng([scenario.seed, 4])
    index = 20
    kinds = ("black", "frozen")
    while index < frames:
        length = int(rng.integers(2, scenario.drop_out_frames + 1))
        kind = kinds[int(rng.integers(2))]
        faults |= {index + step: kind for step in range(length)}
        index += length + int(rng.integers(25, 70))
    return faults


def _burn_in(image: NDArray[np.uint8], t_s: float) -> None:
    """Write a name above and date and running time below onto the picture."""
    height, width = image.shape
    scale = width / 640
    clock = f"2024-05-17  14:{int(t_s) // 60:02d}:{int(t_s) % 60:02d}.{int(t_s * 100) % 100:02d}"
    for text, x, y in (
        ("CULVERT 12  DN300  DOWNSTREAM", 14 * scale, 28 * scale),
        (clock, width - 330 * scale, height - 14 * scale),
    ):
        for grey, thickness in ((0, 5), (245, 2)):
            cv2.putText(
                image,
                text,
                (round(x), round(y)),
                cv2.FONT_HERSHEY_SIMPLEX,
                0.75 * scale,
                grey,
                max(1, round(thickness * scale)),
                cv2.LINE_AA,
            )
