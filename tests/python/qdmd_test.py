# SPDX-License-Identifier: LGPL-2.1-or-later
"""The module qdmd: pictures, settings, errors, threads, and decompositions against numpy's."""
import ast
import inspect
import pathlib
import re
import sys
import threading
import time
import types
import typing
import warnings

import numpy as np
import pytest

import qdmd
from qdmd import _native

WIDTH, HEIGHT = 80, 60


def street(count, shape=(HEIGHT, WIDTH, 3), dtype=np.uint8, seed=1):
    """A textured wall with noise, and a bright square that walks before it."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[:shape[0], :shape[1]]
    wall = np.stack([60 + (7 * x + 3 * y) % 80, 50 + (5 * x + 11 * y) % 90, 70 + (13 * x + y) % 70], axis=-1)
    for t in range(count):
        frame = wall + random.integers(-2, 3, wall.shape)
        left = 2 * t % (shape[1] - 12)
        frame[20:32, left:left + 12] = (240, 20, 230)
        if len(shape) == 2:
            frame = frame[..., 1]
        elif shape[2] == 1:
            frame = frame[..., 1:2]
        elif shape[2] == 4:
            frame = np.concatenate([frame, np.full(frame.shape[:2] + (1,), 200)], axis=-1)
        if dtype == np.uint16:
            frame = frame * 256 + random.integers(0, 256, frame.shape)
        yield frame.astype(dtype)


SHAPES = [(HEIGHT, WIDTH), (HEIGHT, WIDTH, 1), (HEIGHT, WIDTH, 3), (HEIGHT, WIDTH, 4)]


@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
@pytest.mark.parametrize('shape', SHAPES)
def test_apply_finds_what_moves(shape, dtype):
    separator = qdmd.Separator(window_size=20)
    assert separator.background() is None
    for t, frame in enumerate(street(50, shape, dtype)):
        mask = separator.apply(frame)
        assert mask.shape == (HEIGHT, WIDTH) and mask.dtype == np.uint8
        assert set(np.unique(mask)) <= {0, 255}
        if t == 0:
            assert not mask.any()
    truth = np.zeros((HEIGHT, WIDTH), bool)
    left = 2 * 49 % (WIDTH - 12)
    truth[20:32, left:left + 12] = True
    found = mask > 0
    assert (found & truth).sum() > 0.9 * truth.sum()
    assert (found & ~truth).sum() < 0.3 * truth.sum()
    background = separator.background()
    assert background.shape == frame.shape and background.dtype == dtype
    scale = 256 if dtype == np.uint16 else 1
    colours = background[..., :3] if len(shape) == 3 else background
    assert np.abs(colours / scale - np.median([f[..., :3] if len(shape) == 3 else f for f in street(50, shape, dtype)],
                                              axis=0) / scale).mean() < 2
    if len(shape) == 3 and shape[2] == 4:
        assert (background[..., 3] == np.iinfo(dtype).max).all()


def test_views_are_what_their_copies_are():
    plain, viewed, flipped, sparse = (qdmd.Separator() for _ in range(4))
    for frame in street(30):
        big = np.full((HEIGHT + 9, WIDTH + 7, 3), 3, np.uint8)
        big[4:4 + HEIGHT, 5:5 + WIDTH] = frame
        mask = plain.apply(frame)
        assert (viewed.apply(big[4:4 + HEIGHT, 5:5 + WIDTH]) == mask).all()
        upside_down = np.ascontiguousarray(frame[::-1])
        assert (flipped.apply(upside_down[::-1]) == mask).all()
        wide = np.repeat(frame, 2, axis=1)
        assert (sparse.apply(wide[:, ::2]) == mask).all()
    assert mask.any()


@pytest.mark.parametrize('shape', [(1, 1), (1, 7, 3), (7, 1, 3), (1, 1, 4)])
def test_pictures_of_one_row_or_column(shape):
    big = np.zeros(tuple(4 * side for side in shape[:2]) + shape[2:], np.uint8)
    separator, other = qdmd.Separator(), qdmd.Separator()
    for t in range(5):
        big[...] = 10 * t
        thin = big[:1, :shape[1]] if shape[0] == 1 else big[:shape[0], :1]
        assert (separator.apply(thin) == other.apply(thin.copy())).all()
        room = np.ones(thin.shape[:2], np.uint8)
        assert separator.apply(thin, room) is room
        other.apply(thin)
    assert separator.background().shape == shape


def test_frames_are_not_changed_and_may_be_read_only():
    separator = qdmd.Separator()
    for frame in street(5):
        before = frame.copy()
        frame.flags.writeable = False
        separator.apply(frame)
        assert (frame == before).all()


def test_masks_are_written_where_they_are_wanted():
    plain, separator = qdmd.Separator(), qdmd.Separator()
    room = np.full((HEIGHT + 2, WIDTH + 3), 77, np.uint8)
    inside = room[1:-1, 2:-1]
    for frame in street(20):
        assert separator.apply(frame, inside) is inside
        assert (inside == plain.apply(frame)).all()
    assert inside.any() and (room[0] == 77).all() and (room[:, :2] == 77).all() and (room[:, -1] == 77).all()
    for wrong, error in ((room, ValueError), (room[1:-1, ::2], ValueError), (inside[..., None], ValueError),
                         (np.zeros((HEIGHT, WIDTH)), TypeError), (np.zeros((HEIGHT, 2 * WIDTH), np.uint8)[:, ::2], ValueError)):
        with pytest.raises(error):
            separator.apply(frame, wrong)
    inside.flags.writeable = False
    with pytest.raises(ValueError):
        separator.apply(frame, inside)


def test_bgr_is_rgb_turned_round():
    rgb, bgr = qdmd.Separator(), qdmd.Separator(bgr=True)
    for frame in street(30):
        assert (rgb.apply(frame) == bgr.apply(frame[..., ::-1])).all()
    assert (rgb.background() == bgr.background()[..., ::-1]).all()


@pytest.mark.parametrize('mode', ['batch', 'live'])
def test_separate_gives_each_frame_with_its_pictures(mode):
    separator = qdmd.Separator(mode=mode, window_size=20)
    assert separator.delay == (19 if mode == 'batch' else 0)
    frames, given = list(street(47)), 0

    def feed():
        nonlocal given
        for frame in frames:
            given += 1
            yield frame

    results = []
    for result in separator.separate(feed()):
        if not results:
            assert given == separator.delay + 1
        results.append(result)
    assert len(results) == len(frames)
    for frame, (kept, background, mask) in zip(frames, results):
        assert kept is frame
        assert background.shape == frame.shape and mask.shape == frame.shape[:2]
    frame, background, mask = results[30]
    assert mask[25, 2 * 30 % 68 + 5] == 255 and mask.mean() < 40
    assert np.abs(background.astype(int) - frame)[mask == 0].mean() < 4
    # It goes on.
    assert len(list(separator.separate(frames[:25]))) == 25


def test_separate_that_is_left_loses_what_waits():
    separator = qdmd.Separator(mode='batch', window_size=10)
    for result in separator.separate(street(30)):
        break
    assert len(list(separator.separate(street(12)))) == 12


def test_pictures_and_regions_of_the_frame_that_comes_out():
    separator = qdmd.Separator(window_size=20)
    for t, frame in enumerate(street(40)):
        separator.push(frame)
        assert separator.ready
        mask, background = separator.picture('mask'), separator.picture('background')
        foreground, cutout = separator.picture('foreground'), separator.picture('cutout')
        regions = separator.regions()
        small = separator.regions(min_area=2000)
        separator.skip()
        assert not separator.ready
    assert (foreground == np.abs(frame.astype(int) - background)).all()
    assert (cutout == np.where(mask[..., None] > 0, frame, 0)).all()
    assert len(regions) == 1 and small == []
    region = regions[0]
    assert abs(region.x - 2 * 39 % 68) <= 2 and abs(region.y - 20) <= 2 and region.area > 100
    assert region.mean_residual > 50


def test_settings_do_what_the_elements_do():
    def masks(**settings):
        separator = qdmd.Separator(window_size=20, **settings)
        return [separator.apply(frame) for frame in street(40)]

    plain = masks()
    assert not any(mask[:, :40].any() for mask in masks(ignore=[(0, 0, 40, HEIGHT)]))
    soft = masks(mask_softness=4)[-1]
    small = masks(mask_scale=2)
    assert ((soft > 0) & (soft < 255)).any()
    # Found in fewer pixels: not the same, but nearly.
    assert 0 < (np.array(small) != np.array(plain)).sum() < 0.2 * (np.array(plain) > 0).sum()
    assert not masks(foreground_threshold=442)[-1].any()
    assert all((one == other).all() for one, other in zip(plain, masks(n_threads=1)))
    assert any((one != other).any() for one, other in zip(plain, masks(method='qdmd')))


def test_a_time_lapse_is_told_by_its_rate():
    def found(frame_rate):
        separator, random = qdmd.Separator(frame_rate=frame_rate), np.random.default_rng(4)
        wall = next(street(1)).astype(int)
        wall[20:32, :12] = wall[32:44, :12]  # without the square
        share = []
        for t in range(400):
            frame = wall + random.integers(-3, 4, wall.shape)
            left = random.integers(20, 50)
            frame[20:44, left:left + 8] = (150, 60, 60)
            mask = separator.apply(frame.astype(np.uint8))
            if t >= 250:
                share.append((mask[20:44, left:left + 8] > 0).mean())
        return np.mean(share)

    assert found(1) > 0.97 and found(25) < found(1) - 0.02


def test_says_that_ignore_covers_the_whole_frame():
    frame = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    half = (-3, -3, WIDTH // 2 + 3, HEIGHT + 9)
    separator = qdmd.Separator(window_size=4, ignore=[half, (WIDTH // 2, 0, WIDTH, HEIGHT)])
    with pytest.warns(UserWarning, match=f'covers the whole frame, which is {WIDTH}x{HEIGHT}'):
        separator.apply(frame)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        separator.apply(frame)
        separator.ignore([half])
        separator.apply(frame)


def test_says_once_what_ignore_has_outside_of_the_frame():
    frame = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    separator = qdmd.Separator(window_size=4, ignore=[(0, 0, 1, 1), (WIDTH, 0, 5, 5), (-5, 0, 5, 5)])
    with pytest.warns(UserWarning, match=rf'\({WIDTH}, 0, 5, 5\), \(-5, 0, 5, 5\)\] outside .* {WIDTH}x{HEIGHT}'):
        separator.apply(frame)
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        separator.apply(frame)
        separator.ignore([(-5, -5, 6, 6)])
        separator.apply(frame)
    separator.ignore([(0, HEIGHT, 1, 1)])
    with pytest.warns(UserWarning, match='outside'):
        separator.push(frame)


def test_ignore_and_freeze_hold_from_the_next_frame():
    separator = qdmd.Separator(window_size=20)
    frames = list(street(60))
    for frame in frames[:30]:
        separator.apply(frame)
    separator.ignore([(0, 0, WIDTH, HEIGHT)])
    assert not separator.apply(frames[30]).any()
    separator.ignore([])
    assert separator.apply(frames[31]).any()
    separator.freeze()
    separator.apply(frames[32])
    before = separator.background()
    for frame in frames[33:]:
        separator.apply(255 - frame)
    assert (separator.background() == before).all()


def test_save_and_load(tmp_path):
    separator = qdmd.Separator()
    for frame in street(40):
        separator.apply(frame)
    separator.save(tmp_path / 'street.qdmd')
    fresh = qdmd.Separator(load_location=tmp_path / 'street.qdmd')
    assert (fresh.background() == separator.background()).all()
    # From the first frame on.
    assert fresh.apply(frame).any()
    fresh.reset()
    assert fresh.background() is None
    with pytest.raises(OSError, match='missing'):
        fresh.load(tmp_path / 'missing')
    with pytest.raises(OSError):
        separator.save(tmp_path / 'no folder' / 'file')
    (tmp_path / 'other').write_bytes(b'nothing of ours' * 10)
    with pytest.raises(ValueError):
        fresh.load(tmp_path / 'other')


@pytest.mark.parametrize('settings, word', [
    (dict(window_size=1), 'window-size'), (dict(mode='later'), 'live, batch'), (dict(hop_size=101), 'hop-size'),
    (dict(absorb_time=-1), 'absorb_time'), (dict(frame_rate=0), 'frame_rate'), (dict(solver='fast'), 'gram-extended'),
    (dict(mask_softness=16), 'softness'), (dict(mask_scale=3), 'mask-scale'),
    (dict(ignore=[(1, 2, 3)]), 'x, y, width, height'), (dict(ignore=[(1, 2, 0, 3)]), 'ignore'), (dict(depth=8), 'depth'),
    (dict(foreground_threshold=float('nan')), 'threshold'), (dict(time_budget=-1.0), 'time_budget')])
def test_refused_settings_say_what_to_change(settings, word):
    with pytest.raises(ValueError, match=word):
        qdmd.Separator(**settings)


def test_refused_settings_of_the_wrong_type():
    with pytest.raises(TypeError):
        qdmd.Separator(windowsize=20)
    with pytest.raises((TypeError, RuntimeError)):
        qdmd.Separator(window_size='many')


@pytest.mark.parametrize('frame, error', [
    (np.zeros((4, 5, 3)), TypeError), (np.zeros((4, 5, 3), np.int8), TypeError), ([[1, 2]], TypeError),
    (np.zeros((4, 5, 2), np.uint8), ValueError), (np.zeros(5, np.uint8), ValueError),
    (np.zeros((0, 5), np.uint8), ValueError), (np.zeros((1, 4, 5, 3), np.uint8), ValueError), (None, TypeError)])
def test_refused_frames_change_nothing(frame, error):
    separator = qdmd.Separator()
    for good in street(3):
        separator.apply(good)
    before = separator.background()
    for take in (separator.apply, separator.push):
        with pytest.raises(error):
            take(frame)
    assert (separator.background() == before).all()
    assert not separator.ready


def test_memory_that_is_refused_is_named():
    separator = qdmd.Separator(max_memory=1 << 24)
    with pytest.raises(ValueError, match='max-memory'):
        separator.apply(np.zeros((600, 800, 3), np.uint8))
    assert separator.background() is None


def test_the_window_may_be_on_disk(tmp_path):
    frames = list(street(30))
    masks = [[separator.apply(frame).copy() for frame in frames]
             for separator in (qdmd.Separator(window_size=12), qdmd.Separator(window_size=12, window_on_disk=tmp_path))]
    assert (np.array(masks[0]) == np.array(masks[1])).all()
    assert not any(tmp_path.iterdir())
    with pytest.raises(ValueError, match='window-on-disk'):
        qdmd.Separator(window_on_disk=tmp_path / 'none').apply(frames[0])


def test_calls_out_of_turn_are_refused():
    separator = qdmd.Separator()
    with pytest.raises(ValueError, match='ready'):
        separator.skip()
    with pytest.raises(ValueError, match='mode=batch'):
        qdmd.Separator(mode='batch').apply(np.zeros((4, 5), np.uint8))
    separator.push(np.zeros((4, 5), np.uint8))
    with pytest.raises(ValueError, match='output'):
        separator.picture('all')
    with pytest.raises(ValueError):
        list(separator.separate(street(3)))


def test_python_goes_on_while_a_frame_is_worked_on():
    separator = qdmd.Separator(mode='batch', method='qdmd', window_size=150, n_threads=1, stabilize='off')
    frames = list(street(149, (240, 320, 3)))
    for frame in frames:
        separator.push(frame)
    ticks, stop = [], threading.Event()

    def tick():
        while not stop.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.monotonic()
    separator.push(frames[0])  # solves
    end = time.monotonic()
    stop.set()
    thread.join()
    inside = [tick for tick in ticks if begin < tick < end]
    # With the lock held there would be none between the first and the last moment.
    assert len(inside) >= 3, (len(inside), end - begin)


def test_threads_that_share_a_separator_wait_for_each_other():
    separator = qdmd.Separator(window_size=10)
    frames = list(street(20))

    def work():
        for frame in frames:
            separator.apply(frame)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert separator.background().shape == frames[0].shape


# ---- decompose() ---------------------------------------------------------------------------------------------------


def product(a, b):
    """Of quaternions, on the last axis."""
    aw, ax, ay, az = np.moveaxis(a, -1, 0)
    bw, bx, by, bz = np.moveaxis(b, -1, 0)
    return np.stack([aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
                     aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw], axis=-1)


def numpy_eigenvalues(frames, rank=None):
    """Of the complex adjoint, as the paper does it: each twice or in pairs, of which imag >= 0 is kept."""
    x = np.stack([frame.reshape(-1, 3).astype(float) for frame in frames], axis=1)  # (pixels, m, 3)
    a, b = 1j * x[..., 0], x[..., 1] + 1j * x[..., 2]
    chi = lambda a, b: np.block([[a, b], [-b.conj(), a.conj()]])
    past, next_ = chi(a[:, :-1], b[:, :-1]), chi(a[:, 1:], b[:, 1:])
    u, s, vh = np.linalg.svd(past, full_matrices=False)
    if rank:
        u, s, vh = u[:, :2 * rank], s[:2 * rank], vh[:2 * rank]
    values = np.linalg.eigvals(u.conj().T @ next_ @ vh.conj().T / s)
    # Conjugates come in pairs; real ones twice.
    values = values.real + 1j * np.abs(values.imag)
    order = np.lexsort((values.imag, values.real))
    return values[order][::2]


@pytest.mark.parametrize('rank', [0, 1, 3])
def test_eigenvalues_are_those_of_the_papers_procedure(rank):
    frames = [np.random.default_rng(t).integers(0, 256, (6, 7, 3), dtype=np.uint8) for t in range(9)]
    found = qdmd.decompose(frames, rank=rank)
    assert found.rank == (rank or 8) and found.converged
    expected = numpy_eigenvalues(frames, rank)
    ours = found.eigenvalues[np.lexsort((found.eigenvalues.imag, found.eigenvalues.real))]
    assert len(ours) == len(expected)
    for value in expected:
        assert np.abs(ours - value).min() < 1e-8
    assert (found.eigenvalues.imag >= 0).all() and (found.eigs == found.eigenvalues).all()
    assert (np.diff(np.abs(found.omega)) >= -1e-9).all()


@pytest.mark.parametrize('dtype', [np.uint8, np.uint16])
def test_modes_and_amplitudes_give_the_frames_back(dtype):
    # Two modes: a picture that stays, and one that fades by a half.
    random = np.random.default_rng(3)
    unit = 16 if dtype == np.uint8 else 4096
    still, fading = (unit * random.integers(0, 6, (5, 8, 3)) for _ in range(2))
    frames = [(still + fading // 2 ** t).astype(dtype) for t in range(5)]
    found = qdmd.decompose(frames, rank=2)
    assert len(found.eigenvalues) == 2 and found.modes.shape == (2, 5, 8, 4) and found.amplitudes.shape == (2, 4)
    assert np.abs(found.eigenvalues - [1, 0.5]).max() < 1e-9
    for t, frame in enumerate(frames):
        total = 0
        for mode, value, amplitude, reference in zip(found.modes, found.eigenvalues, found.amplitudes,
                                                     found.reference_times):
            power = value ** (t - reference)
            total = total + product(product(mode, np.array([power.real, power.imag, 0, 0])), amplitude)
        assert np.abs(total[..., 1:] - frame).max() < 1e-6 * unit
        assert np.abs(total[..., 0]).max() < 1e-6 * unit
    assert found.background_modes == 1


def test_L_is_the_elements_background():
    frames = list(street(30))
    found = qdmd.decompose(frames, rank=1)
    separator = qdmd.Separator(mode='batch', method='qdmd', rank=1, window_size=30, stabilize='off')
    for t, (_, background, _) in enumerate(separator.separate(frames)):
        assert np.abs(found.L(t) - background).max() <= 0.51
    assert found.L(0).shape == frames[0].shape
    # omega_threshold takes more modes for the background.
    assert qdmd.decompose(frames, rank=3, omega_threshold=100).background_modes == 3


@pytest.mark.parametrize('shape', SHAPES)
def test_L_has_the_frames_shape(shape):
    frames = list(street(10, shape))
    background = qdmd.decompose(frames, rank=1).L(4)
    assert background.shape == (shape if len(shape) == 2 or shape[2] < 4 else shape[:2] + (3,))
    colours = np.mean([frame[..., :3] if len(shape) == 3 else frame for frame in frames], axis=0)
    assert np.abs(background - colours).mean() < 5


def test_refused_windows():
    frames = list(street(3))
    for wrong in ([], frames[:1], [frames[0], frames[1][:5]], [frames[0], frames[1].astype(np.uint16)]):
        with pytest.raises(ValueError):
            qdmd.decompose(wrong)
    with pytest.raises(ValueError):
        qdmd.decompose(frames, rank=-1)
    with pytest.raises(TypeError):
        qdmd.decompose([frame.astype(float) for frame in frames])


# ---- What people read ----------------------------------------------------------------------------------------------


def test_help_tells_of_each_setting():
    settings = inspect.signature(qdmd.Separator.__init__).parameters
    for name in settings:
        if name != 'self':
            # Newer interpreters take the indentation out.
            assert re.search(rf'^ *{name} ', qdmd.Separator.__doc__, re.MULTILINE), name
    for name in qdmd.__all__:
        assert getattr(qdmd, name).__doc__, name
    for name, member in inspect.getmembers(qdmd.Separator):
        if not name.startswith('_'):
            assert (member.fget if isinstance(member, property) else member).__doc__, name


def test_everything_has_type_hints():
    functions = [qdmd.decompose] + [member.fget if isinstance(member, property) else member for name, member in
                                    inspect.getmembers(qdmd.Separator) if not name.startswith('_')]
    for function in functions:
        hints = typing.get_type_hints(function)
        expected = set(inspect.signature(function).parameters) - {'self'} | {'return'}
        assert expected <= set(hints), function


def test_stub_is_what_the_extension_has():
    path = pathlib.Path(qdmd.__file__).with_name('_native.pyi')
    classes = {node.name: {item.name for item in node.body} - {'__init__'} for node in ast.parse(path.read_text()).body
               if isinstance(node, ast.ClassDef)}
    for name, methods in classes.items():
        real = {method for method in vars(getattr(_native, name)) if not method.startswith('_')}
        assert methods == real, name
    assert set(classes) | {'decompose'} == {name for name in vars(_native) if not name.startswith('_')}


class Video:
    """What the page asks of OpenCV, which need not be there."""
    written = {}

    def __init__(self, name):
        self.frames = street(40)

    def read(self):
        frame = next(self.frames, None)
        return frame is not None, frame

    @classmethod
    def imwrite(cls, name, picture):
        cls.written[name] = picture


def test_lines_of_the_page_run(monkeypatch, capsys):
    page = (pathlib.Path(__file__).parents[2] / 'docs' / 'python.md').read_text()
    blocks = re.findall(r'^```python\n(.*?)^```', page, re.DOTALL | re.MULTILINE)
    assert len(blocks) == 4
    assert len(blocks[0].strip().splitlines()) <= 11
    opencv = types.ModuleType('cv2')
    opencv.VideoCapture, opencv.imwrite = Video, Video.imwrite
    monkeypatch.setitem(sys.modules, 'cv2', opencv)
    names = {'frames': list(street(60))}
    for block in blocks:
        exec(block, names)
    assert Video.written['background.png'].shape == (HEIGHT, WIDTH, 3)
    assert names['people'].any() and names['background'].shape == (HEIGHT, WIDTH, 3)
    assert '(5, 60, 80, 4)' in capsys.readouterr().out
