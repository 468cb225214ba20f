"""parameters.json of a run folder: what the run changes on its vehicle, written before anything is changed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Protocol

from mavquad.drivers.run_folder import write_whole
from mavquad.errors import ConfigError, RunFolderError
from mavquad.protocol.param_record import ChangedParameters
from mavquad.schema import parse_section

NAME = "parameters.json"
_HINT = "mavquad writes it whole, so it was cut or changed afterwards; set the parameters with a ground station"


class Folder(Protocol):
    """A run folder that a file can be written into; `mavquad.drivers.run_folder.RunFolder` is one."""

    def write_whole(self, name: str, text: str) -> None:
        """Write a file so that it appears whole or not at all."""


def write_parameters(folder: Folder, changed: ChangedParameters) -> None:
    """Keep what is about to be changed, or that it was put back; whole or not at all.

    Raises:
        RunFolderError: it cannot be written; nothing may be changed then.
    """
    folder.write_whole(NAME, _text(changed))


def mark_restored(folder: Path, changed: ChangedParameters) -> None:
    """Note in a run folder of earlier that its parameters were put back.

    Raises:
        RunFolderError: it cannot be written.
    """
    write_whole(folder / NAME, _text(changed.model_copy(update={"restored": True})))


def _text(changed: ChangedParameters) -> str:
    return changed.model_dump_json(indent=2) + "\n"


def read_parameters(folder: Path) -> ChangedParameters | None:
    """What a run changed on its vehicle; None if it changed nothing.

    Raises:
        RunFolderError: this is no run folder, or the file cannot be read.
    """
    if not (folder / "config.toml").is_file():
        raise RunFolderError(str(folder), "is no run folder (it has no config.toml)", "give the folder of a flight")
    path = folder / NAME
    try:
        return parse_section(ChangedParameters, json.loads(path.read_text(encoding="utf-8")), str(path))
    except FileNotFoundError:
        return None
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise RunFolderError(str(path), f"cannot be read ({reason})") from None
    except ConfigError as error:
        where = f"{error.key}: " if error.key else ""
        raise RunFolderError(str(path), f"is damaged ({where}{error.reason})", _HINT) from None
    except (ValueError, RecursionError):
        raise RunFolderError(str(path), "is damaged (it is no JSON)", _HINT) from None
