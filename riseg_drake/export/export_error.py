"""What can be wrong with an export, said in one line."""

from importlib import import_module
from types import ModuleType


class ExportError(ValueError):
    """Why an export cannot be made, for the person who asked for it."""


def require(module: str, file_format: str) -> ModuleType:
    """A module that only one format needs; ExportError names the command that brings it."""
    try:
        return import_module(module)
    except ImportError as error:
        raise ExportError(
            f"--export {file_format} needs {module.split('.')[0]} ({error}): pip install 'riseg-drake[export]'"
        ) from None
