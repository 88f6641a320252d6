"""Reads the recording of flexspline_identify_bench and identifies the same model with NumPy and SciPy. Argument: the
bench's folder. Writes answer.txt: ms to read, ms to identify, peak bytes of each, a sum over the positions, parameters."""
import resource
import sys
import time
from pathlib import Path

import numpy as np
from scipy.linalg import lstsq
from scipy.signal import butter, sosfiltfilt

folder = Path(sys.argv[1])
about = (folder / "about.txt").read_text().split()
sample_hz, cutoff_hz, km, width = map(float, about[:4])
first, step, count, runs = map(int, about[4:])


def peak():
    return 1024.0 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def median_ms(work):
    times = []
    for _ in range(runs):
        start = time.process_time()
        result = work()
        times.append(1e3 * (time.process_time() - start))
    return float(np.median(times)), result


def read():
    return np.loadtxt(folder / "data.csv", delimiter=",", skiprows=3)


def slope(x):
    return np.gradient(x, 1.0 / sample_hz, edge_order=2)


sos = butter(5, cutoff_hz, fs=sample_hz, output="sos")
slowest = max(np.sqrt(abs(s[5])) if s[5] != 0.0 else abs(s[4]) for s in sos)
padding = int(np.ceil(np.log(1e-6) / np.log(slowest)))


def filtered(x):
    return sosfiltfilt(sos, x, axis=-1, padlen=padding)


def identify():
    w = slope(filtered(data[:, 2]))
    block = np.stack([slope(w), w, np.abs(w), np.tanh(w / width), km * data[:, 1]])
    rows = filtered(block)[:, first : first + step * count : step].T
    size = np.linalg.norm(rows[:, :4], axis=0)
    return lstsq(rows[:, :4] / size, rows[:, 4], lapack_driver="gelsy")[0] / size


read_ms, data = median_ms(read)
read_peak = peak()
identify_ms, found = median_ms(identify)
numbers = [read_ms, identify_ms, read_peak, peak(), np.abs(data[:, 2]).sum(), *found]
(folder / "answer.txt").write_text(" ".join(f"{x:.17g}" for x in numbers) + "\n")
