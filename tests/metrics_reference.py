#!/usr/bin/env python3
"""Writes data/metrics.json, the figures that tests/metrics.rs expects.

Needs flip-evaluator 1.7, scikit-image 0.26 and numpy 2. The image pairs are those of metrics.rs, formula by formula
in float32; the figures are those of design section 6, SSIM by scikit-image and FLIP by flip-evaluator.
"""

import json
import math
import pathlib

import flip_evaluator
import numpy as np
from skimage.metrics import peak_signal_noise_ratio, structural_similarity

F = np.float32


def unit(seed, x, y, c):
    """Hash of (seed, x, y, c) as float32 in 0..1."""
    h = (((seed * 1024 + y.astype(np.uint64)) * 1024 + x.astype(np.uint64)) * 4 + c.astype(np.uint64)) % 2**32
    for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B)):
        h = ((h ^ (h >> np.uint64(shift))) * np.uint64(factor)) % 2**32
    h = h ^ (h >> np.uint64(16))
    return (h >> np.uint64(8)).astype(F) * F(2.0**-24)


class Pair:
    def __init__(self, width, height):
        self.w, self.h = width, height
        self.y, self.x, self.c = np.meshgrid(
            np.arange(height), np.arange(width), np.arange(3), indexing="ij"
        )

    def unit(self, seed):
        return unit(seed, self.x, self.y, self.c)

    def base(self):
        """Ramp, checks, a coloured disc and grain."""
        v = self.x.astype(F) / F(self.w) * F(0.5) + F(0.1)
        dark = F(0.25) + F(0.2) * self.c.astype(F)
        v = np.where((self.x // 8 + self.y // 6) % 2 == 1, v * dark, v)
        dx, dy = self.x - self.w // 2, self.y - self.h // 2
        disc = dx * dx + dy * dy < (self.h // 3) ** 2
        v = np.where(disc, v * np.array([1.5, 0.75, 0.25], F)[self.c], v)
        return v * (F(0.75) + F(0.5) * self.unit(1))

    def lamps(self, seed, size):
        """1 in the cells of `size` pixels that the hash picks, one in sixteen, else 0."""
        cell = unit(seed, self.x // size, self.y // size, self.c * 0)
        return np.where(cell < F(0.0625), F(1), F(0))

    def noisy(self, image, amount):
        return image * (F(1) + F(amount) * (self.unit(2) - F(0.5)))

    def shifted(self, image, dx, dy):
        return image[np.minimum(self.y + dy, self.h - 1), np.minimum(self.x + dx, self.w - 1), self.c]

    def blurred(self, image):
        total = np.zeros_like(image)
        for dy in (-1, 0, 1):
            for dx in (-1, 0, 1):
                y, x = np.clip(self.y + dy, 0, self.h - 1), np.clip(self.x + dx, 0, self.w - 1)
                total = total + image[y, x, self.c]
        return total * F(0.111)


def pairs():
    """(name, A, B, kind, mask) of every pair."""
    p = Pair(64, 48)
    base = p.base()
    yield "equal", base, base, "linear", None
    yield "noise_weak", p.noisy(base, 0.05), base, "linear", None
    yield "noise_middle", p.noisy(base, 0.5), base, "linear", None
    yield "noise_strong", p.noisy(base, 2.0), base, "linear", None
    yield "shift", p.shifted(base, 2, 1), base, "linear", None
    yield "blur", p.blurred(base), base, "linear", None
    yield "exposure", base * F(1.5), base, "linear", None
    lit = base + F(1500) * p.lamps(3, 4)
    yield "lamps", p.noisy(lit, 0.4) + F(300) * p.lamps(4, 1), lit, "linear", None
    yield "dark", p.noisy(base, 0.7) * F(2.0**-12), base * F(2.0**-12), "linear", None
    bad = p.noisy(base, 0.3)
    bad[5, 7, 1], bad[20, 40, 0], bad[47, 63, 2] = np.nan, np.inf, -np.inf
    mask = (p.x[..., 0] + 2 * p.y[..., 0]) % 5 != 0
    yield "masked_not_finite", bad, base, "linear", mask

    p = Pair(37, 23)
    base = p.base()
    black = base * np.where(p.x % 6 == 0, F(0), F(1))
    yield "odd_size", p.noisy(black, 1.0), black, "linear", None
    yield "odd_size_display", p.noisy(base, 0.6), base, "display", None

    p = Pair(50, 40)
    base = np.clip(p.base(), F(0), F(1))
    yield "display_noise", np.clip(p.noisy(base, 0.2), F(0), F(1)), base, "display", None
    yield "display_shift", p.shifted(base, 1, 3), base, "display", None
    yield "display_contrast", base * base, base, "display", None
    yield "display_blur", p.blurred(base), base, "display", None


def tone_mapped(image, scale):
    y = np.maximum(image.astype(np.float64) @ np.array([0.2126, 0.7152, 0.0722]) * scale, 0)
    t = y / (1 + y)
    return np.where(t <= 0.0031308, 12.92 * t, 1.055 * t ** (1 / 2.4) - 0.055)


def ssim(a, b, counted):
    if min(b.shape[:2]) < 11:
        return None
    y = b.astype(np.float64) @ np.array([0.2126, 0.7152, 0.0722])
    scale = 0.18 / np.exp(np.mean(np.log(y[y > 0]))) if (y > 0).any() else 1.0
    settings = dict(gaussian_weights=True, sigma=1.5, use_sample_covariance=False, data_range=1, full=True)
    whole, values = structural_similarity(tone_mapped(b, scale), tone_mapped(a, scale), **settings)
    inner = (slice(5, -5), slice(5, -5))
    if counted.all():
        assert abs(whole - values[inner].mean()) < 1e-12
    return values[inner][counted[inner]].mean() if counted[inner].any() else None


def flip(a, b, kind, counted):
    mode = "HDR" if kind == "linear" else "LDR"
    errors, mean, _ = flip_evaluator.evaluate(
        np.ascontiguousarray(b), np.ascontiguousarray(a), mode, inputsRGB=False, applyMagma=False
    )
    if counted.all():
        # Its own mean is summed in float32.
        assert abs(mean - errors.mean(dtype=np.float64)) < 1e-4, (mean, errors.mean(dtype=np.float64))
    return errors[..., 0][counted].mean(dtype=np.float64)


def figures(a, b, kind, mask):
    finite = np.isfinite(a).all(-1) & np.isfinite(b).all(-1)
    selected = np.ones(finite.shape, bool) if mask is None else mask
    counted = finite & selected
    x, y = a[counted].astype(np.float64), b[counted].astype(np.float64)
    m = y.mean()
    relative = (x - y) ** 2 / (y**2 + 0.01 * m**2)
    per_pixel = np.sort(relative.mean(-1))
    with np.errstate(divide="ignore"):
        psnr = peak_signal_noise_ratio(y, x, data_range=y.max() if kind == "linear" else 1.0)
    a, b = np.where(finite[..., None], a, F(0)), np.where(finite[..., None], b, F(0))
    result = {
        "rel_mse": relative.mean(),
        "mean_ratio": x.mean() / m,
        "rmse": np.sqrt(np.mean((x - y) ** 2)),
        "mean_a": x.mean(),
        "mean_b": m,
        "ssim": ssim(a, b, counted),
        "flip": flip(a, b, kind, counted),
        "psnr": psnr,
        "max_abs": np.abs(x - y).max(),
        "nan_count": int((selected & ~finite).sum()),
        "rel_mse_trimmed": per_pixel[: len(per_pixel) - len(per_pixel) // 1000].mean(),
    }
    defined = {k: v if isinstance(v, int) or v is None else float(v) for k, v in result.items()}
    return {k: v if v is None or math.isfinite(v) else None for k, v in defined.items()}


def main():
    table = {name: figures(a, b, kind, mask) for name, a, b, kind, mask in pairs()}
    path = pathlib.Path(__file__).parent / "data" / "metrics.json"
    path.write_text(json.dumps(table, indent=1) + "\n")
    print(f"{len(table)} pairs written to {path}")


if __name__ == "__main__":
    main()
