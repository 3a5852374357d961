"""A GNSS digital twin: a signal generator, a software receiver and a judge that compares them.

>>> import gnss_twin
>>> run = gnss_twin.run(gnss_twin.Scene.open("scenarios/static.toml"))
>>> run.receiver["fixes"]["latitude_deg"].mean()

Records are tables: dictionaries of columns, each a numpy array, which pandas and polars take as they are.
Samples are arrays in the type that their format has; :func:`to_complex` makes complex numbers of them.
"""

import sys as _sys

import numpy as _np

from ._native import (
    Batch,
    Error,
    GenerateError,
    Generator,
    JudgeError,
    Live,
    Metadata,
    Outcome,
    ReceiveError,
    Receiver,
    Run,
    ScenarioError,
    Scene,
    SettingsError,
    Step,
    StepError,
    StudyError,
    __version__,
    judge,
    program as _run_program,
    receive,
    run,
    study,
)

__all__ = [
    "Batch",
    "Error",
    "GenerateError",
    "Generator",
    "JudgeError",
    "Live",
    "Metadata",
    "Outcome",
    "ReceiveError",
    "Receiver",
    "Run",
    "ScenarioError",
    "Scene",
    "SettingsError",
    "Step",
    "StepError",
    "StudyError",
    "__version__",
    "judge",
    "open_recording",
    "receive",
    "run",
    "study",
    "to_complex",
]

_TYPES = {"ci8": "int8", "cu8": "uint8", "ci16_le": "<i2", "cf32_le": "<c8", "ri8": "int8", "ri16_le": "<i2"}


def to_complex(samples):
    """Samples as complex64, in units of their least significant bit; real ones have no imaginary part."""
    samples = _np.asarray(samples)
    if samples.dtype == _np.complex64:
        return samples
    paired = samples.ndim == 2
    plain = samples.astype(_np.float32)
    if samples.dtype == _np.uint8:
        # Offset binary: zero lies between 127 and 128.
        plain -= 127.5
    return plain.view(_np.complex64)[:, 0] if paired else plain.astype(_np.complex64)


def open_recording(path):
    """The metadata of a SigMF recording, and its samples as an array that is read from the file as it is used."""
    path = str(path)
    base = path.removesuffix(".sigmf-meta").removesuffix(".sigmf-data")
    metadata = Metadata.open(base + ".sigmf-meta")
    kind = _np.dtype(_TYPES[metadata.format])
    samples = _np.memmap(base + ".sigmf-data", dtype=kind, mode="r")
    pairs = metadata.sample_bytes // kind.itemsize
    whole = samples[: len(samples) // pairs * pairs]
    return metadata, whole.reshape(-1, 2) if pairs == 2 else whole


def _program():
    return _run_program(_sys.argv)
