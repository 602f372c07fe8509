"""Rows as data: faults of a file name row and key, values of several cases are reduced, rows keep their verdicts."""

from math import nan

import pytest

from gears3d.errors import InputError
from gears3d.verification.papers import PAPERS, Bench, hold, paper
from gears3d.verification.papers.measures.responses import losses
from gears3d.verification.papers.published import cases, evaluate, parse

ROW = """
citation = "A."
contents = ["fig. 1"]
[[row]]
figure = "fig. 1"
quantity = "q"
published = 1.0
tolerance = 0.1
scenario = "rigaud-2020/fig10"
measure = "outcome"
args = { of = "impacts_per_period" }
"""


@pytest.fixture(scope="module")
def bench():
    return Bench()


def rows():
    for name in PAPERS:
        for claim in paper(name).claims:
            yield pytest.param(claim, id=f"{name} {claim.figure} {claim.quantity}"[:80])


@pytest.mark.slow
@pytest.mark.parametrize("claim", [*rows()])
def test_every_row_has_the_verdict_on_record(claim, bench):
    result = hold(claim, bench)
    assert result.verdict == claim.recorded, result.computed


def test_the_lubricated_base_case_is_double_sided_and_repeats_every_two_periods(bench):
    found = [claim for claim in paper("dct-helical-lubricated").claims if claim.figure == "fig. 13"]
    assert [hold(claim, bench).computed for claim in found] == ["double_sided", "2T"]


def test_a_table_added_to_a_file_is_a_row(tmp_path, bench):
    file = tmp_path / "rows.toml"
    file.write_text(ROW.replace("published = 1.0", "published = 2.0"))
    (claim,) = parse("a", file).claims
    assert hold(claim, bench).verdict == "agrees"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("measure =", "measured =", ["row[0].measured", "did you mean 'measure'", "row[0].measure: is missing"]),
        ('"outcome"', '"outcom"', ["row[0].measure", "did you mean 'outcome'"]),
        ("rigaud-2020/fig10", "rigaud-2020/fig1", ["row[0].scenario", "did you mean 'rigaud-2020/fig1"]),
        ('"fig. 1"\nquantity', '"fig. 1"\nrecorded = "yes"\nquantity', ["row[0].recorded", '"agrees" or']),
        ("of =", "off =", ["row[0].args", "responses.outcome"]),
        ('"fig. 1"\nquantity', '"fig. 1"\nnote = "nowhere"\nquantity', ["row[0].note", "[notes]"]),
        ("tolerance = 0.1", "tolerance = 0.0", ["numbers a positive one"]),
        ("published = 1.0", "published 1.0", ["is not TOML"]),
        ("citation", "cite", ["cite: is unknown", "citation: is missing"]),
    ],
)
def test_faults_of_a_file_name_row_and_key(tmp_path, old, new, words):
    file = tmp_path / "rows.toml"
    file.write_text(ROW.replace(old, new))
    with pytest.raises(InputError) as caught:
        parse("a", file)
    assert all(word in str(caught.value) for word in words), caught.value


def test_a_row_is_evaluated_for_every_combination_and_reduced(bench):
    row = {
        "scenario": ["rigaud-2020/fig10", "rigaud-2020/fig11"],
        "set": {"run.duration": "1 s"},
        "vary": {"drag.torque": ["0.2 N m", "0.4 N m"], "impact.restitution": [0, 0.5]},
        "measure": "outcome",
    }
    found = cases(bench, row)
    assert len(found) == 8
    assert found[1].overrides == {"run.duration": "1 s", "drag.torque": "0.2 N m", "impact.restitution": 0.5}
    row |= {"args": [{"of": "impacts"}, {"of": "impacts_per_period"}], "over": "relative_change"}
    first, last = found[0].outcome["impacts"], found[-1].outcome["impacts_per_period"]
    assert evaluate(bench, row) == pytest.approx(first / last - 1.0)


def test_several_values_need_a_reduction(bench):
    row = {"figure": "fig. 1", "quantity": "q", "scenario": "rigaud-2020/fig10", "measure": "losses"}
    with pytest.raises(InputError, match=r"fig\. 1, q: losses gives several values \(reduce them with over\)"):
        evaluate(bench, row)


def test_arrays_are_reduced_before_the_values_of_several_cases(bench):
    row = {"scenario": ["rigaud-2020/fig10", "rigaud-2020/fig11"], "measure": "losses", "over": ["mean", "ratio"]}
    means = [losses(bench.case(name)).mean() for name in row["scenario"]]
    assert evaluate(bench, row) == pytest.approx(means[0] / means[1])


def test_numbers_and_words_become_the_words_of_the_paper(bench):
    row = {"scenario": "rigaud-2020/fig10", "set": {"run.duration": "1 s"}, "measure": "outcome"}
    row |= {"args": {"of": "impacts_per_period"}, "words": [[0.5, "none"], [nan, "some"]]}
    assert evaluate(bench, row) == "some"
    row |= {"args": {"of": "regime"}, "words": {"double_sided": "both"}}
    assert evaluate(bench, row) == "both"
