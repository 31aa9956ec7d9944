"""The example notebook: the committed file, and its execution on a tiny study."""

import base64
from collections.abc import Callable
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

import etendue

NOTEBOOK = etendue.ROOT / "scripts" / "example.ipynb"
PNG = b"\x89PNG\r\n"


def results(notebook: nbformat.NotebookNode) -> tuple[str, bytes]:
    """The text of the table and the figure, which are the only outputs."""
    table, figure = (cell.outputs for cell in notebook.cells if cell.cell_type == "code")
    assert [output.output_type for output in (*table, *figure)] == ["execute_result", "display_data"]
    return table[0].data["text/plain"], base64.b64decode(figure[0].data["image/png"])


def test_it_is_committed_with_its_results_and_small() -> None:
    table, figure = results(nbformat.read(NOTEBOOK, as_version=4))
    assert table.split().count("stratified") == 1 and figure.startswith(PNG)
    assert NOTEBOOK.stat().st_size < 100_000


def test_it_plots_a_study(tiny_study: Callable[..., Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STUDY", str(tiny_study(("mine", "etendue", [2, 8]))))
    monkeypatch.setenv("OUT", str(tmp_path / "out"))
    monkeypatch.setenv("ETENDUE", str(etendue.binary()))
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    resources = {"metadata": {"path": str(NOTEBOOK.parent)}}
    NotebookClient(notebook, timeout=None, startup_timeout=600, resources=resources).execute()
    table, figure = results(notebook)
    rows = etendue.read_rows(tmp_path / "out")
    for samples, group in rows.groupby("spp"):
        line = next(line for line in table.splitlines() if line.replace("mine", "").split()[:2] == [str(samples), "2"])
        assert line.split()[-2] == f"{group['rmse'].mean():.6f}"
    assert figure.startswith(PNG)
