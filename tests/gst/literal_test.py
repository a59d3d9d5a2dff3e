#!/usr/bin/python3
# SPDX-License-Identifier: LGPL-2.1-or-later
"""Compares the element with the paper's algorithms, written out a second time in numpy.

40 frames of 52x36 with noise 3, moving boxes and a light that drifts by 0.4 % a frame; the element
must be within one grey level of Q-DMD (Algorithm 2) and of exact DMD (Algorithm 1), full rank,
amplitudes from the first frame.
"""
import os
import subprocess
import sys
import tempfile

import numpy as np

FRAMES, WIDTH, HEIGHT = 40, 52, 36


def make_clip(seed):
    """Frames x height x width x RGB, 8 bits."""
    random = np.random.default_rng(seed)
    still = random.integers(40, 200, (HEIGHT, WIDTH, 3)).astype(float)
    frames = []
    for t in range(FRAMES):
        frame = still * (1 + 0.004 * t)
        x, y = (2 * t) % (WIDTH - 8), t % (HEIGHT - 6)
        frame[5:13, x:x + 8] = [230, 30, 60]
        frame[y:y + 6, 30:38] = [20, 220, 90]
        frame += random.normal(0, 3, frame.shape)
        frames.append(np.clip(np.rint(frame), 0, 255))
    return np.array(frames, dtype=np.uint8)


# A quaternion matrix A + B j is the pair (A, B).
def adjoint(q):
    a, b = q
    return np.block([[a, b], [-b.conj(), a.conj()]])


def from_adjoint(columns):
    half = columns.shape[0] // 2
    return columns[:half], -columns[half:].conj()


def multiply(p, q):
    return p[0] @ q[0] - p[1] @ q[1].conj(), p[0] @ q[1] + p[1] @ q[0].conj()


def conjugate_transpose(q):
    return q[0].conj().T, -q[1].T


def literal_qdmd(clip):
    pixels = clip.reshape(FRAMES, -1, 3).transpose(1, 0, 2).astype(float)
    snapshots = 1j * pixels[:, :, 0], pixels[:, :, 1] + 1j * pixels[:, :, 2]
    x = tuple(part[:, :-1] for part in snapshots)
    y = tuple(part[:, 1:] for part in snapshots)
    u, s, vh = np.linalg.svd(adjoint(x), full_matrices=False)
    u, v, s = from_adjoint(u[:, ::2]), from_adjoint(vh.conj().T[:, ::2]), s[::2]
    v_over_s = v[0] / s, v[1] / s
    q_tilde = multiply(multiply(conjugate_transpose(u), y), v_over_s)
    values, vectors = np.linalg.eig(adjoint(q_tilde))
    upper = [i for i, value in enumerate(values) if value.imag > 1e-9]
    real = sorted((i for i, value in enumerate(values) if abs(value.imag) <= 1e-9),
                  key=lambda i: values[i].real)
    standard = upper + real[::2]
    assert len(standard) == FRAMES - 1, len(standard)
    values = values[standard]
    phi = multiply(multiply(y, v_over_s), from_adjoint(vectors[:, standard]))
    first = np.vstack([snapshots[0][:, :1], -snapshots[1][:, :1].conj()])
    b = from_adjoint(np.linalg.lstsq(adjoint(phi), first, rcond=None)[0])
    p = np.argmin(np.abs(np.log(values)))
    background = []
    for t in range(FRAMES):
        share = values[p] ** t * b[0][p:p + 1], values[p] ** t * b[1][p:p + 1]
        level = multiply((phi[0][:, p:p + 1], phi[1][:, p:p + 1]), share)
        background.append(np.stack([level[0].imag, level[1].real, level[1].imag], -1))
    return np.array(background).reshape(clip.shape)


def literal_dmd(clip):
    background = np.zeros(clip.shape)
    for c in range(3):
        pixels = clip[:, :, :, c].reshape(FRAMES, -1).T.astype(float)
        u, s, vh = np.linalg.svd(pixels[:, :-1], full_matrices=False)
        values, vectors = np.linalg.eig(u.T @ pixels[:, 1:] @ vh.T / s)
        phi = pixels[:, 1:] @ (vh.T / s) @ vectors
        b = np.linalg.lstsq(phi, pixels[:, 0].astype(complex), rcond=None)[0]
        p = np.argmin(np.abs(np.log(values.astype(complex))))
        assert abs(values[p].imag) < 1e-12, "this clip's background mode is real"
        for t in range(FRAMES):
            level = (phi[:, p] * values[p] ** t * b[p]).real
            background[t, :, :, c] = level.reshape(HEIGHT, WIDTH)
    return background


def element(clip, options):
    with tempfile.TemporaryDirectory() as folder:
        source, result = os.path.join(folder, 'in'), os.path.join(folder, 'out')
        clip.tofile(source)
        subprocess.run(
            ['gst-launch-1.0', '-q', 'filesrc', 'location=' + source,
             'blocksize=%d' % clip[0].size, '!', 'rawvideoparse', 'format=rgb',
             'width=%d' % WIDTH, 'height=%d' % HEIGHT, '!', 'qdmdbackground',
             'window-size=%d' % FRAMES, 'amplitude=first-frame', 'rank=0', *options, '!',
             'filesink', 'location=' + result], check=True, timeout=120)
        return np.fromfile(result, np.uint8).reshape(clip.shape)


def main():
    worst = 0
    for seed in (5, 6, 7):
        clip = make_clip(seed)
        qdmd, dmd = literal_qdmd(clip), literal_dmd(clip)
        for literal, options in ((qdmd, ['method=qdmd', 'solver=gram']),
                                 (qdmd, ['method=qdmd', 'solver=adjoint']),
                                 (dmd, ['method=dmd'])):
            expected = np.rint(np.clip(literal, 0, 255))
            difference = int(np.abs(element(clip, options) - expected).max())
            worst = max(worst, difference)
            print('clip %d, %s: at most %d levels' % (seed, ' '.join(options), difference))
    return 0 if worst <= 1 else 1


if __name__ == '__main__':
    sys.exit(main())
