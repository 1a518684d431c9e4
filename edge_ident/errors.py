"""All errors that a user can act on.

EdgeIdentError
├── LinkError    the line between host and board failed                 exit code 3
│   ├── NoReplyError   no answer in time
│   └── ChangedWordError   a word came out as another one
├── BoardError   the board refused a command or is in fault             exit code 4
├── DataError    a recording, description or settings file is unusable  exit code 5
├── ModelError   a network, manifest or model file is unusable          exit code 5
└── GainError    gains are doubtful; nothing was written                exit code 1

Each carries one line of cause and one line of next step.
"""

from firmware_interface.errors import BoardError, EdgeIdentError, LinkError

__all__ = ["BoardError", "DataError", "EdgeIdentError", "GainError", "LinkError", "ModelError"]


class DataError(EdgeIdentError):
    """The recording or drive description cannot be used as it is."""

    exit_code = 5
    code = "data"


class ModelError(EdgeIdentError):
    """The network, its manifest or a model file is missing, damaged or of the wrong kind."""

    exit_code = 5
    code = "model"


class GainError(EdgeIdentError):
    """The gains are outside what the board or sound margins allow; the board is unchanged."""

    exit_code = 1
    code = "gains"
