# SPDX-License-Identifier: LGPL-2.1-or-later
"""Separates the background and the foreground of video of a camera that stands still.

    import qdmd

    separator = qdmd.Separator()
    for frame in frames:                  # numpy arrays: (height, width, 3), uint8
        mask = separator.apply(frame)     # (height, width), uint8: 255 is foreground
    background = separator.background()

Separator separates frame by frame or window by window; decompose() gives the quaternion dynamic mode decomposition of a
window: eigenvalues, modes, amplitudes and L(t).
"""
from __future__ import annotations

import collections
import dataclasses
import os
import warnings
from typing import Any, Iterable, Iterator, NamedTuple, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _native

__all__ = ['Decomposition', 'Region', 'Separated', 'Separator', 'decompose']
__version__ = '0.1.0'

Frame = npt.NDArray[Any]
Rectangle = Sequence[int]


class Region(NamedTuple):
    """A box around foreground, in pixels. mean_residual: levels from the background, of its foreground."""
    x: int
    y: int
    width: int
    height: int
    area: int
    mean_residual: float


class Separated(NamedTuple):
    """A frame as it was given, its background and its mask."""
    frame: Frame
    background: Frame
    mask: npt.NDArray[np.uint8]


class Separator:
    """Separates the frames of one camera, in their order.

    Frames are numpy arrays of the shape (height, width), or with 1, 3 (RGB) or 4 channels (RGBA), of uint8 or uint16.
    They are not copied if the pixels of a row lie side by side. A frame of another shape or type begins anew.

    Settings have the names and the meaning of the properties of qdmdbackground (docs/element.md), with _ for -:

    mode                  'live': each frame at once; 'batch': window_size - 1 frames later, against its own window
    method                'robust', 'qdmd' (the paper's) or 'dmd' (each channel by itself)
    window_size           frames that are decomposed together, 2 to 2048
    hop_size              frames between solves in mode='live'; 0: a quarter of window_size
    rank                  singular values that are kept; 0: chosen by the method
    omega_threshold       rad/frame; 0: the mode nearest the origin alone
    amplitude             'window' or 'first-frame' (the paper's)
    solver                'auto', 'gram', 'gram-extended', 'qr' or 'adjoint'
    estimator             'exact', 'forward-backward', 'total' or 'optimized'
    sample_step           pixels, up to 64; 0: chosen
    iterations            of method='robust', up to 20
    stabilize             'off', 'translation' or 'similarity': follow a camera that shakes
    stabilize_output      pictures as if the camera stood still
    foreground_threshold  levels, up to 442; 0: from the noise
    shadows               'background', 'foreground' or 'marked' (127 in masks)
    mask_softness         pixels over which the edge of a mask fades, up to 15
    ignore                rectangles (x, y, width, height), 64 at most, in which nothing is foreground
    absorb_time           seconds until what came and stands is background; 0: never
    time_budget           milliseconds that a frame may take on average; 0: no limit
    mask_scale            masks are found in a picture so many times smaller: 1, 2 or 4; 0: chosen, where apply() is the
                          first call, from the size of the frame
    n_threads             0: one for each core. Changes no result
    max_memory            bytes
    window_on_disk        a folder where the frames of the window lie in a file; None: in memory
    load_location         a file of save() to go on from

    Three more are not the element's, which knows them from its video:

    frame_rate            frames per second, for absorb_time; below 5 masks treat them as a time lapse
    depth                 bits of a sample of uint16, 9 to 16: the lowest ones of each word
    bgr                   channels are B, G, R, as OpenCV has them

    A setting that is refused is a ValueError that says what to change. Calls from several threads wait for each other;
    Python's other threads go on meanwhile.
    """

    def __init__(self, *, mode: str = 'live', method: str = 'robust', window_size: int = 100, hop_size: int = 0,
                 rank: int = 0, omega_threshold: float = 0.0, amplitude: str = 'window', solver: str = 'auto',
                 estimator: str = 'exact', sample_step: int = 0, iterations: int = 1,
                 stabilize: str = 'translation', stabilize_output: bool = False, foreground_threshold: float = 0.0,
                 shadows: str = 'background', mask_softness: int = 0, ignore: Iterable[Rectangle] = (),
                 absorb_time: float = 300.0, time_budget: float = 0.0, mask_scale: int = 0, n_threads: int = 0,
                 max_memory: int = 4 << 30, window_on_disk: Optional[Union[str, os.PathLike[str]]] = None,
                 load_location: Optional[Union[str, os.PathLike[str]]] = None,
                 frame_rate: float = 25.0, depth: int = 16, bgr: bool = False) -> None:
        if not absorb_time >= 0 or not frame_rate > 0:
            raise ValueError('absorb_time must be 0 (never) or more seconds, and frame_rate above 0')
        absorb_frames = max(1, round(min(absorb_time * frame_rate, 2e9))) if absorb_time > 0 else 0
        areas = _rectangles(ignore)
        self._native = _native.Separator(dict(
            mode=mode, method=method, window_size=window_size, hop_size=hop_size, rank=rank,
            omega_threshold=omega_threshold, amplitude=amplitude, solver=solver, estimator=estimator,
            sample_step=sample_step, iterations=iterations, stabilize=stabilize, stabilize_output=stabilize_output,
            foreground_threshold=foreground_threshold, shadows=shadows, mask_softness=mask_softness,
            ignore=areas, absorb_frames=absorb_frames, frame_rate=frame_rate,
            time_budget=time_budget, mask_scale=mask_scale, n_threads=n_threads, max_memory=max_memory,
            window_on_disk=os.fspath(window_on_disk or '')), depth, bgr)
        self._delay = window_size - 1 if mode == 'batch' else 0
        self._waiting = 0
        self._new_areas = areas  # no frame has been seen with them
        if load_location is not None:
            self.load(load_location)

    @property
    def delay(self) -> int:
        """Frames that go in before the first one comes out: 0 in mode='live', else window_size - 1."""
        return self._delay

    def apply(self, frame: Frame, mask: Optional[npt.NDArray[np.uint8]] = None) -> npt.NDArray[np.uint8]:
        """Learns from a frame and returns its mask, (height, width) of uint8: 255 where something is not background.

        mask: an array in which to write it, which saves the time for a new one. mode='live' only. The first mask is
        empty, since nothing is known yet.
        """
        if self._new_areas:
            self._warn_of_areas(frame)
        return self._native.apply(frame, mask)

    def background(self) -> Optional[Frame]:
        """The newest background, with the frames' shape and type; None where nothing is known yet."""
        return self._native.background()

    def separate(self, frames: Iterable[Frame]) -> Iterator[Separated]:
        """Yields (frame, background, mask) for each of `frames`, in their order, in any mode.

        In mode='batch' the first comes after window_size frames, and the last ones come when `frames` end. Frames are
        kept until then, and must not be overwritten.
        """
        if self._waiting:
            raise ValueError('frames that were pushed wait: take them first')
        kept: collections.deque[Frame] = collections.deque()
        try:
            for frame in frames:
                self.push(frame)
                kept.append(frame)
                yield from self._take(kept)
            self.drain()
            yield from self._take(kept)
        finally:
            if self._waiting:
                # Nobody wants the rest.
                self.drain()
                while self.ready:
                    self.skip()

    def _take(self, kept: collections.deque[Frame]) -> Iterator[Separated]:
        while self.ready:
            separated = Separated(kept.popleft(), self.picture('background'), self.picture('mask'))
            self.skip()
            yield separated

    def push(self, frame: Frame) -> None:
        """A frame goes in. While `ready`, take pictures of the frames that come out, and skip() each."""
        if self._new_areas:
            self._warn_of_areas(frame)
        self._native.push(frame)
        self._waiting += 1

    @property
    def ready(self) -> bool:
        """A frame comes out: picture() and regions() are about it."""
        return self._native.ready()

    def picture(self, output: str) -> Frame:
        """'background', 'foreground' (abs(frame - background)), 'mask' or 'cutout' of the frame that comes out."""
        return self._native.picture(output)

    def regions(self, min_area: int = 0) -> list[Region]:
        """Boxes around the foreground of the frame that comes out, the largest first, 64 at most.

        min_area: pixels of foreground that a region has at least; 0: 1/2000 of the picture, at least 4.
        """
        return [Region(*region) for region in self._native.regions(min_area)]

    def skip(self) -> None:
        """The frame that comes out is done with: the next one does."""
        self._native.skip()
        self._waiting -= 1

    def drain(self) -> None:
        """No frame follows: all that wait come out. The next one begins a new window."""
        self._native.drain()

    def freeze(self, freeze: bool = True) -> None:
        """While on, the background stays as it is."""
        self._native.freeze(freeze)

    def ignore(self, rectangles: Iterable[Rectangle]) -> None:
        """The setting `ignore`, from the next frame on."""
        areas = _rectangles(rectangles)
        self._native.ignore(areas)
        self._new_areas = areas

    def _warn_of_areas(self, frame: Frame) -> None:
        """Where rectangles of `ignore` have no pixel of a frame, or all of them, as often as they are set."""
        if np.ndim(frame) < 2:
            return
        height, width = np.shape(frame)[:2]
        outside = [area for area in self._new_areas
                   if area[0] >= width or area[1] >= height or area[0] + area[2] <= 0 or area[1] + area[3] <= 0]
        left = np.ones((height, width), dtype=bool)
        for x, y, columns, rows in self._new_areas:
            left[max(y, 0):max(y + rows, 0), max(x, 0):max(x + columns, 0)] = False
        self._new_areas = []
        if left.size and not left.any():
            warnings.warn(f'ignore covers the whole frame, which is {width}x{height}: nothing will ever be foreground',
                          stacklevel=3)
        if outside:
            warnings.warn(f'ignore has {outside} outside of the frame, which is {width}x{height}', stacklevel=3)

    def reset(self) -> None:
        """Forgets the frames, the window and the background."""
        self._native.reset()
        self._waiting = 0

    def save(self, file: Union[str, os.PathLike[str]]) -> None:
        """Writes what was learnt; qdmdbackground's load-location reads it. OSError where the file cannot be written."""
        try:
            self._native.save(os.fspath(file))
        except RuntimeError as error:
            raise OSError(str(error)) from None

    def load(self, file: Union[str, os.PathLike[str]]) -> None:
        """Goes on from what was saved, of frames of this size. OSError where the file cannot be read."""
        try:
            self._native.load(os.fspath(file))
        except RuntimeError as error:
            raise OSError(str(error)) from None


def _rectangles(rectangles: Iterable[Rectangle]) -> list[tuple[int, int, int, int]]:
    areas = [tuple(int(side) for side in rectangle) for rectangle in rectangles]
    if any(len(area) != 4 for area in areas):
        raise ValueError('ignore has rectangles (x, y, width, height)')
    return areas  # type: ignore[return-value]


@dataclasses.dataclass(frozen=True)
class Decomposition:
    """The quaternion dynamic mode decomposition of a window of m frames: what decompose() returns.

    A pixel is the quaternion R i + G j + B k; of grey frames R = G = B. The window is
    x_t ~ sum_p modes[p] * eigenvalues[p] ** (t - reference_times[p]) * amplitudes[p], t = 0 .. m - 1, with quaternion
    products in this order. The last axis of modes and amplitudes has the parts 1, i, j, k.
    """
    eigenvalues: npt.NDArray[np.complex128]  #: (P,), the nearest to the origin of omega = log(lambda) first; imag >= 0
    amplitudes: npt.NDArray[np.float64]  #: (P, 4), of all modes together
    reference_times: npt.NDArray[np.float64]  #: (P,), frames: 0, of modes that grow m - 1
    background_modes: int  #: so many modes, the first ones, are the background
    rank: int  #: singular values that were kept
    condition: float  #: largest over smallest singular value that was kept
    converged: bool  #: False: no solver could, and rank one or the mean of the frames is in its place
    _combination: npt.NDArray[np.float64]
    _model: Any
    _planes: npt.NDArray[np.float64]  # (3 m, pixels)
    _shape: tuple[int, ...]

    @property
    def eigs(self) -> npt.NDArray[np.complex128]:
        """The eigenvalues, by PyDMD's name."""
        return self.eigenvalues

    @property
    def omega(self) -> npt.NDArray[np.complex128]:
        """log(eigenvalues), in rad/frame."""
        with np.errstate(divide='ignore'):
            return np.log(self.eigenvalues)

    @property
    def modes(self) -> npt.NDArray[np.float64]:
        """(P, height, width, 4): made anew with each call."""
        m, modes = self._combination.shape[:2]
        w, x, y, z = np.moveaxis(self._combination, -1, 0)  # (m, P)
        # (R i + G j + B k) (w + x i + y j + z k): rows of parts 1, i, j, k by columns of R, G, B.
        parts = np.array([[-x, -y, -z], [w, z, -y], [-z, w, x], [y, -x, w]])  # (4, 3, m, P)
        weights = parts.transpose(3, 0, 2, 1).reshape(modes * 4, m * 3)
        pictures = weights @ self._planes
        return np.moveaxis(pictures.reshape(modes, 4, *self._shape[:2]), 1, -1)

    def L(self, t: float) -> npt.NDArray[np.float64]:
        """The background at frame t (0: the first), in levels, with a frame's shape (no alpha). t may lie outside of
        the window. Its amplitudes are fitted without the other modes, as qdmdbackground does it."""
        levels = self._model.weights(t) @ (self._model.basis() @ self._planes)
        picture = levels.T.reshape(*self._shape[:2], 3)
        if len(self._shape) == 2:
            return picture[..., 0].copy()
        return picture[..., :min(self._shape[2], 3)].copy()


def decompose(frames: Iterable[Frame], *, rank: int = 0, omega_threshold: float = 0.0, amplitude: str = 'window',
              solver: str = 'auto', estimator: str = 'exact', depth: int = 16, n_threads: int = 0) -> Decomposition:
    """The quaternion dynamic mode decomposition of a window, method='qdmd' of qdmdbackground.

    frames: 2 to 2048 arrays of one shape and type, as Separator takes them. Settings mean what they mean there; rank 0
    is full rank. Alpha is not looked at.
    """
    pictures = [np.asarray(frame) for frame in frames]
    settings = dict(
        mode='batch', method='qdmd', window_size=100, hop_size=0, rank=rank, omega_threshold=omega_threshold,
        amplitude=amplitude, solver=solver, estimator=estimator, sample_step=0, iterations=1, stabilize='off',
        stabilize_output=False, foreground_threshold=0.0, shadows='background', mask_softness=0, ignore=[],
        absorb_frames=0, frame_rate=25.0, time_budget=0.0, mask_scale=1, n_threads=n_threads,
        max_memory=4 << 30, window_on_disk='')
    if len(pictures) < 2:
        raise ValueError('give at least two frames')
    found = _native.decompose(pictures, settings, depth)
    shape = pictures[0].shape
    samples = np.stack(pictures).astype(np.float64).reshape(len(pictures), shape[0] * shape[1], -1)
    colours = samples[..., :3] if samples.shape[2] >= 3 else np.repeat(samples, 3, axis=2)
    return Decomposition(
        eigenvalues=found['eigenvalues'], amplitudes=found['amplitudes'][:, 0], rank=found['rank'],
        reference_times=found['reference_times'], background_modes=found['background_modes'],
        condition=found['condition'], converged=found['converged'], _combination=found['combination'],
        _model=found['background'], _planes=colours.transpose(0, 2, 1).reshape(-1, shape[0] * shape[1]), _shape=shape)
