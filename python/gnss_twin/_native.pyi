"""The compiled part of gnss_twin."""

from collections.abc import Sequence
from os import PathLike
from typing import Any, final

from numpy.typing import NDArray

_Column = NDArray[Any]
_Table = dict[str, _Column]
_Tables = dict[str, _Table]
_Path = str | PathLike[str]
_Settings = str | dict[str, Any] | PathLike[str]
_Vector = Sequence[float] | NDArray[Any]
_Samples = NDArray[Any] | bytes | bytearray | memoryview

__all__ = [
    "__version__",
    "Error",
    "ScenarioError",
    "SettingsError",
    "GenerateError",
    "ReceiveError",
    "StepError",
    "StudyError",
    "JudgeError",
    "Metadata",
    "Scene",
    "Generator",
    "Batch",
    "Receiver",
    "Outcome",
    "Run",
    "Live",
    "Step",
    "receive",
    "run",
    "judge",
    "study",
    "program",
]

__version__: str

class Error(Exception): ...
class ScenarioError(Error): ...
class SettingsError(Error): ...
class GenerateError(Error): ...
class ReceiveError(Error): ...
class StepError(Error): ...
class StudyError(Error): ...
class JudgeError(Error): ...

@final
class Metadata:
    """Metadata of a front end's samples."""

    def __new__(
        cls,
        format: str,
        sample_rate_hz: float,
        *,
        center_hz: float = 1575.42e6,
        inverted: bool = False,
        start: str | None = None,
    ) -> Metadata: ...
    @staticmethod
    def open(path: _Path) -> Metadata:
        """Reads a .sigmf-meta file."""

    def to_sigmf(self) -> str:
        """The JSON text of a .sigmf-meta file."""

    @property
    def format(self) -> str: ...
    @property
    def sample_rate_hz(self) -> float: ...
    @property
    def center_hz(self) -> float: ...
    @property
    def inverted(self) -> bool: ...
    @property
    def start(self) -> str | None: ...
    @property
    def sample_bytes(self) -> int: ...

@final
class Scene:
    """A scene: a scenario, composed."""

    @staticmethod
    def open(
        path: _Path,
        *,
        seed: int | None = None,
        format: str | None = None,
        station: str | None = None,
        front_end: str | None = None,
        allow_outside: bool = False,
    ) -> Scene:
        """Reads a file; files that it names are relative to its directory."""

    @staticmethod
    def from_toml(
        text: str,
        *,
        directory: _Path | None = None,
        seed: int | None = None,
        format: str | None = None,
        station: str | None = None,
        front_end: str | None = None,
        allow_outside: bool = False,
    ) -> Scene:
        """Reads a text; files that it names are relative to `directory`, or else to the working one."""

    @staticmethod
    def from_dict(
        keys: dict[str, Any],
        *,
        directory: _Path | None = None,
        seed: int | None = None,
        format: str | None = None,
        station: str | None = None,
        front_end: str | None = None,
        allow_outside: bool = False,
    ) -> Scene:
        """Reads a dictionary with the keys of a scenario; one that is None is not there. Files are as for a text."""

    @property
    def name(self) -> str: ...
    @property
    def duration_s(self) -> float: ...
    @property
    def seed(self) -> int: ...
    @property
    def signals(self) -> list[str]: ...
    @property
    def samples(self) -> int:
        """Number of samples of its first front end."""

    @property
    def metadata(self) -> Metadata:
        """Metadata of its only front end."""

    @property
    def front_ends(self) -> list[Metadata]: ...
    @property
    def warnings(self) -> list[str]: ...
    def slice(self, first: int = 0, end: int | None = None) -> NDArray[Any]:
        """Samples `first` to before `end` of its only front end: the same bits as in the whole."""

    def plan(self) -> str:
        """Plan in words: computations, omissions and their reasons."""

@final
class Batch:
    """Some samples of a scene, and what is true of them."""

    @property
    def first_sample(self) -> int: ...
    @property
    def samples(self) -> NDArray[Any]: ...
    @property
    def truth(self) -> _Tables: ...

@final
class Generator:
    """Iterates a scene's samples from the first to the last."""

    def __new__(cls, scene: Scene, *, batch_samples: int = 524288) -> Generator: ...
    @property
    def metadata(self) -> Metadata: ...
    def __iter__(self) -> Generator: ...
    def __next__(self) -> Batch: ...

@final
class Outcome:
    """Outcome of a reception; its text is one line."""

    @property
    def tables(self) -> _Tables:
        """Records: all after `receive`, those since the last push after `Receiver.finish`."""

    @property
    def summary(self) -> dict[str, Any]:
        """Content of receiver.json as the program writes it."""

@final
class Receiver:
    """A cold start on samples that come in pieces."""

    def __new__(cls, of: Scene | Metadata | Sequence[Metadata], settings: _Settings | None = None) -> Receiver: ...
    def push(self, samples: _Samples, *, front_end: int = 0) -> _Tables:
        """Takes the next samples, cut anywhere, and returns what they brought."""

    def finish(self) -> Outcome:
        """Ends the reception."""

@final
class Run:
    """Outcome of generator and receiver; its text is a few lines."""

    @property
    def truth(self) -> _Tables: ...
    @property
    def receiver(self) -> _Tables: ...
    @property
    def summary(self) -> dict[str, Any]:
        """Content of receiver.json as the program writes it."""

    @property
    def judgement(self) -> dict[str, Any] | None:
        """Content of summary.json as the program writes it; present if the run's files were written."""

@final
class Step:
    """Result of a step. The receiver's records are about samples of some steps before."""

    @property
    def first_sample(self) -> int: ...
    @property
    def samples(self) -> NDArray[Any]: ...
    @property
    def truth(self) -> _Tables: ...
    @property
    def receiver(self) -> _Tables: ...
    @property
    def position_m(self) -> list[float]:
        """ECEF position of the vehicle at the step's end, in metres."""

    @property
    def velocity_mps(self) -> list[float]: ...
    @property
    def made_of(self) -> str:
        """waiting, fresh, extrapolated or snap."""

    @property
    def gap_m(self) -> float:
        """Distance from the pushed motion, in metres."""

@final
class Live:
    """A scene whose motion is pushed, in lock step with a simulation."""

    def __new__(cls, scene: Scene, settings: _Settings | None = None, *, receive: bool = True) -> Live: ...
    @property
    def metadata(self) -> Metadata: ...
    @property
    def start_position_m(self) -> list[float]: ...
    @property
    def next_s(self) -> float:
        """Time of the state that the next step takes: its end, in seconds since the scene's start."""

    @property
    def is_done(self) -> bool: ...
    def step(
        self,
        position_m: _Vector | None = None,
        velocity_mps: _Vector | None = None,
        acceleration_mps2: _Vector | None = None,
        *,
        jerk_mps3: _Vector | None = None,
        angles_rad: _Vector | None = None,
        rates_radps: _Vector | None = None,
        t_s: float | None = None,
    ) -> Step:
        """Makes the next step with a state, ECEF, at its end or at `t_s`; without one as the vehicle moves already."""

    def switch(self, event: str) -> int:
        """Switches something from the next step on, as `jammer 1 on`; returns the first sample."""

    def finish(self) -> tuple[Outcome, _Tables]:
        """Ends the run: what the receiver found last, and the truth that is known at the end alone."""

def receive(samples: _Samples, of: Scene | Metadata, settings: _Settings | None = None) -> Outcome:
    """Receives an array from its first sample to its last."""

def run(scene: Scene, settings: _Settings | None = None, *, out: _Path | None = None) -> Run:
    """Generates and receives a scene; with `out`, its files are written there and judged."""

def judge(directory: _Path) -> dict[str, Any]:
    """Judges the files of a run, writes tables, pictures and a report beside them; returns the summary."""

def study(study: _Path, *, out: _Path) -> tuple[_Table, _Table]:
    """Runs the study in a file; returns its cells and its cases. What `out` has already is not computed again."""

def program(arguments: Sequence[str]) -> int:
    """The command line, with arguments of which the first is its own name; returns its exit code."""
