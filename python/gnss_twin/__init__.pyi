from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._native import (
    Batch as Batch,
    Error as Error,
    GenerateError as GenerateError,
    Generator as Generator,
    JudgeError as JudgeError,
    Live as Live,
    Metadata as Metadata,
    Outcome as Outcome,
    ReceiveError as ReceiveError,
    Receiver as Receiver,
    Run as Run,
    ScenarioError as ScenarioError,
    Scene as Scene,
    SettingsError as SettingsError,
    Step as Step,
    StepError as StepError,
    StudyError as StudyError,
    __version__ as __version__,
    judge as judge,
    receive as receive,
    run as run,
    study as study,
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

def to_complex(samples: NDArray[Any]) -> NDArray[np.complex64]: ...
def open_recording(path: str | PathLike[str]) -> tuple[Metadata, NDArray[Any]]: ...
