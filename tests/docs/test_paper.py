"""docs/paper.md against `riseg evaluate --ablation`: its literal scenario, and the rows of its table."""

from riseg_drake.app.evaluate.ablation import LITERAL, switched, versions
from riseg_drake.app.scenario import Scenario
from riseg_drake.app.scenario_file import parse_scenario
from tests.docs.pages import CHECKOUT, blocks, section, table_rows

PAGE = CHECKOUT / "docs" / "paper.md"


def test_the_literal_scenario_is_what_the_ablation_calls_literal():
    (block,) = blocks(PAGE, "yaml")
    literal = parse_scenario(block.text, Scenario, source=str(block))
    assert repr(literal) == repr(switched(Scenario(), versions()[LITERAL]))


def test_the_ablation_has_a_row_for_every_switch():
    rows = [row[0] for row in table_rows(section(PAGE, "The ablation"))]
    assert rows == ["**riseg_drake**", *versions()]
