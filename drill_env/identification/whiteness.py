"""Whether prediction errors are white and apart from the voltage, with tests and in words."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import toeplitz
from scipy.special import gammaincc
from scipy.stats import chi2

from drill_env._types import FloatArray

_LONGEST_LAG = 2.0
_MOST_LAGS = 400
_FEWEST_SAMPLES = 50
# Lags of the test against the voltage, and how weak a direction of them it still uses.
_TEST_LAGS = 40
_WEAKEST = 1e-4
_SMOOTH = 5
_NORMAL_95 = 1.959963984540054


@dataclass(frozen=True, slots=True, eq=False)
class Whiteness:
    """Standardised prediction errors of one channel: white ones look like unit dice.

    Attributes:
        samples: how many there are.
        rms: their root mean square; 1 where the noise has the size that was expected.
        lags: of the autocorrelation, s, shape (m,).
        autocorrelation: at `lags`, shape (m,).
        band: half width of the range that holds 95 % of a white series' correlations.
        outside: share of `autocorrelation` outside the band; 0.05 is expected.
        p_white: of Ljung and Box's test over `lags`.
        peak_hz: frequency that stands out most, Hz.
        peak: power there over that of a white series.
        p_peak: that a white series shows such a peak anywhere.
        cross_lags: s by which the error comes after the voltage, shape (k,); no entry where the
            voltage is constant.
        cross: correlation with the voltage at `cross_lags`, shape (k,).
        cross_outside: share of `cross` outside the band.
        cross_largest: lag (s) and value of the largest entry of `cross`, behind the voltage.
        p_cross: of the chi-square test that the error does not follow the voltage; NaN where
            the voltage is constant.
    """

    samples: int
    rms: float
    lags: FloatArray
    autocorrelation: FloatArray
    band: float
    outside: float
    p_white: float
    peak_hz: float
    peak: float
    p_peak: float
    cross_lags: FloatArray
    cross: FloatArray
    cross_outside: float
    cross_largest: tuple[float, float]
    p_cross: float

    def as_dict(self) -> dict[str, Any]:
        """Figures without the curves, plain values for JSON."""
        lag, value = self.cross_largest
        known = math.isfinite(self.p_cross)
        return {
            "samples": self.samples,
            "rms": self.rms,
            "band": self.band,
            "outside_share": self.outside,
            "ljung_box_p": self.p_white,
            "peak": {"hz": self.peak_hz, "power": self.peak, "p": self.p_peak},
            "voltage": {
                "outside_share": self.cross_outside,
                "largest": {"lag_s": lag, "correlation": value},
                "p": self.p_cross,
            }
            if known
            else None,
        }


def whiteness(errors: FloatArray, u: FloatArray, interval: float) -> Whiteness | None:
    """Test standardised prediction errors.

    Args:
        errors: prediction errors over their standard deviations, NaN where none is, shape (n,).
        u: voltages, V, shape (n,).
        interval: between the rows, s.

    Returns:
        None for fewer than 50 errors.
    """
    used = np.isfinite(errors)
    count = int(used.sum())
    if count < _FEWEST_SAMPLES:
        return None
    e = np.where(used, errors, 0.0)
    size = float(np.sqrt(np.sum(e * e) / count))
    e = e / size if size > 0 else e
    m = min(round(_LONGEST_LAG / interval), _MOST_LAGS, count // 4)
    whole, pairs = _products(e, e, used, used, m)
    auto = whole / count
    p_white = float(chi2.sf(np.sum(auto[m + 1 :] ** 2 / pairs[m + 1 :]) * count**2, m))
    band = _NORMAL_95 / math.sqrt(count)
    hz, peak, p_peak = _peak(e, interval)
    cross, p_cross = _voltage(e, used, u, m)
    lags: FloatArray = interval * np.arange(-m, m + 1, dtype=np.float64)
    behind = cross[m + 1 :]
    largest = int(np.abs(behind).argmax()) if len(behind) else 0
    return Whiteness(
        samples=count, rms=size, lags=lags[m + 1 :], autocorrelation=auto[m + 1 :], band=band,
        outside=_share(auto[m + 1 :], band), p_white=p_white, peak_hz=hz, peak=peak, p_peak=p_peak,
        cross_lags=lags if len(cross) else lags[:0], cross=cross,
        cross_outside=_share(cross, band) if len(cross) else 0.0,
        cross_largest=(lags[m + 1 + largest], float(behind[largest])) if len(cross) else (0.0, 0.0),
        p_cross=p_cross,
    )  # fmt: skip


def _share(values: FloatArray, band: float) -> float:
    return float(np.mean(np.abs(values) > band))


def _products(
    x: FloatArray, y: FloatArray, x_used: FloatArray, y_used: FloatArray, m: int
) -> tuple[FloatArray, FloatArray]:
    """Sums of x(t) y(t - lag) and numbers of pairs for lags -m..m, both of shape (2 m + 1,)."""
    size = 1 << (len(x) + m).bit_length()

    def sums(a: FloatArray, b: FloatArray) -> FloatArray:
        product = np.fft.rfft(a.astype(float), size) * np.fft.rfft(b.astype(float), size).conj()
        whole = np.fft.irfft(product, size)
        return np.concatenate([whole[-m:], whole[: m + 1]]) if m else whole[:1]

    return sums(x, y), np.maximum(np.round(sums(x_used, y_used)), 1.0)


def _voltage(e: FloatArray, used: FloatArray, u: FloatArray, m: int) -> tuple[FloatArray, float]:
    """Correlation with the voltage at lags -m..m, and the p-value of the lags behind it."""
    volts = u - u.mean()
    power = float(np.sqrt(np.mean(volts**2)))
    if power <= 1e-9 * (1.0 + float(np.abs(u).max())):
        return np.zeros(0), math.nan
    volts = volts / power
    everywhere = np.ones(len(u), dtype=bool)
    count = int(used.sum())
    cross = _products(e, volts, used, everywhere, m)[0] / count
    # Only behind the voltage: ahead of it a controller's answer would show.
    stride = max(1, m // _TEST_LAGS)
    lags = np.arange(1, m + 1, stride)
    own = _products(volts, volts, everywhere, everywhere, m)[0][m:] / len(u)
    values, vectors = np.linalg.eigh(toeplitz(own[lags - lags[0]]))
    kept = values > _WEAKEST * values[-1]
    told = vectors[:, kept].T @ cross[m + lags]
    return cross, float(chi2.sf(count * np.sum(told**2 / values[kept]), int(kept.sum())))


def _peak(e: FloatArray, interval: float) -> tuple[float, float, float]:
    """Frequency (Hz), power over a white series' and p-value of the highest peak."""
    power = np.abs(np.fft.rfft(e)) ** 2
    frequencies = np.fft.rfftfreq(len(e), interval)
    # The mean of a few neighbours is less of a lottery than a single one.
    power = power / float(np.sum(e * e))
    smooth = np.convolve(power, np.full(_SMOOTH, 1.0 / _SMOOTH), mode="valid")
    place = int(smooth.argmax())
    near = slice(place, place + _SMOOTH)
    middle = float(np.sum(frequencies[near] * power[near]) / np.sum(power[near]))
    alone = float(gammaincc(_SMOOTH, _SMOOTH * smooth[place]))
    trials = len(smooth)
    return middle, float(smooth[place]), float(-np.expm1(trials * np.log1p(-min(alone, 0.999))))
