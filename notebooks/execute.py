"""Execute the notebooks and store them with their outputs: `python notebooks/execute.py`."""

from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode

FOLDER = Path(__file__).parent
LONGEST = 300
"""A cell that takes longer has hung, s."""
KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}


def executed(notebook: Path, folder: Path = FOLDER) -> NotebookNode:
    """The notebook with the outputs of today's code, run in a folder. Raises CellExecutionError."""
    content = nbformat.read(notebook, as_version=4)
    resources = {"metadata": {"path": str(folder)}}
    NotebookClient(content, timeout=LONGEST, kernel_name="python3", resources=resources).execute()
    # What differs from one machine and one hour to the next is not kept.
    content.metadata = NotebookNode(kernelspec=KERNEL, language_info={"name": "python"})
    for number, cell in enumerate(content.cells):
        cell.metadata, cell.id = NotebookNode(), f"cell-{number}"
    return content


if __name__ == "__main__":
    for path in sorted(FOLDER.glob("*.ipynb")):
        nbformat.write(executed(path), path)
        print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")
