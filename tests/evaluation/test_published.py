import pytest

from riseg_drake.evaluation.published import PUBLISHED

TABLE_1 = """\
| MSMFormer | 0 | 76.9 | 40.7 | 45.7 | 55.1 | 31.7 | 31.6 | 32.315 |
| MSMFormer | 1 | 79.9 | 43.5 | 48.9 | 56.8 | 34.8 | 34.4 | 37.870 |
| MSMFormer | 2 | 80.7 | 42.1 | 49.6 | 53.1 | 33.9 | 35.0 | 39.608 |
| MSMFormer | 3 | 84.0 | 44.5 | 51.2 | 61.7 | 37.0 | 38.7 | 43.646 |
| MSMFormer | 4 | 77.9 | 40.9 | 48.2 | 54.2 | 35.3 | 36.3 | 36.026 |
| MSMFormer | 5 | 77.0 | 51.0 | 59.0 | 47.9 | 40.3 | 41.5 | 44.000 |
| SAM | 0 | 63.6 | 59.0 | 61.1 | 35.3 | 62.1 | 43.7 | 61.389 |
| SAM | 1 | 62.7 | 53.3 | 55.2 | 36.3 | 54.3 | 39.3 | 56.019 |
| SAM | 2 | 61.7 | 55.2 | 57.8 | 34.9 | 57.8 | 41.5 | 55.980 |
| SAM | 3 | 58.6 | 52.8 | 55.0 | 33.3 | 55.3 | 39.4 | 50.521 |
| SAM | 4 | 60.0 | 57.5 | 58.6 | 31.6 | 58.5 | 39.9 | 58.718 |
| SAM | 5 | 57.0 | 52.3 | 54.1 | 29.3 | 53.5 | 35.9 | 51.833 |
| rt-RISeg | 0 | 100.0 | 0.0 | 0.0 | 100.0 | 0.0 | 0.0 | 0.000 |
| rt-RISeg | 1 | 89.2 | 19.6 | 30.5 | 54.8 | 12.5 | 19.2 | 25.185 |
| rt-RISeg | 2 | 92.7 | 34.5 | 48.4 | 54.2 | 21.5 | 30.0 | 35.980 |
| rt-RISeg | 3 | 92.9 | 48.3 | 60.6 | 51.7 | 30.0 | 37.0 | 52.813 |
| rt-RISeg | 4 | 89.9 | 59.9 | 70.1 | 57.1 | 39.8 | 46.3 | 67.436 |
| rt-RISeg | 5 | 85.2 | 71.8 | 75.4 | 55.8 | 49.3 | 51.8 | 75.100 |
| rt-RISeg + SAM | 0 | 100.0 | 0.0 | 0.0 | 100.0 | 0.0 | 0.0 | 0.000 |
| rt-RISeg + SAM | 1 | 98.4 | 21.1 | 32.4 | 86.7 | 21.3 | 31.8 | 23.796 |
| rt-RISeg + SAM | 2 | 98.4 | 36.5 | 51.6 | 80.0 | 34.4 | 46.8 | 36.471 |
| rt-RISeg + SAM | 3 | 98.5 | 51.6 | 65.2 | 80.1 | 49.7 | 59.5 | 54.896 |
| rt-RISeg + SAM | 4 | 96.8 | 61.9 | 74.1 | 82.6 | 61.2 | 69.5 | 65.513 |
| rt-RISeg + SAM | 5 | 91.4 | 73.4 | 79.5 | 79.1 | 72.4 | 74.9 | 76.667 |
"""
"""The paper's Table 1 beside the data of its figure: method, step i, Overlap P R F, Boundary P R F, objects
with F >= 75 %."""


@pytest.mark.parametrize("line", TABLE_1.splitlines())
def test_the_published_figures_are_those_of_the_paper(line):
    method, step, *figures = (cell.strip() for cell in line.strip("|").split("|"))
    assert PUBLISHED[method][int(step)] == tuple(map(float, figures))


def test_every_method_has_all_six_steps():
    assert {method: len(rows) for method, rows in PUBLISHED.items()} == dict.fromkeys(
        ("rt-RISeg", "rt-RISeg + SAM", "SAM", "MSMFormer"), 6
    )
