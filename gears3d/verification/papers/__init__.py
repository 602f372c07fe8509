"""Published operating points run again: each number or trend that a paper gives, next to the computed one.

A paper is a folder of scenarios with a file of published rows (:mod:`gears3d.verification.papers.published`). To add a
row: add a table to the file. To add a paper: write the file, and add its name to :data:`PAPERS`.
"""

from gears3d.verification.papers.bench import Bench as Bench
from gears3d.verification.papers.published import PAPERS as PAPERS
from gears3d.verification.papers.published import Claim as Claim
from gears3d.verification.papers.published import Figure as Figure
from gears3d.verification.papers.published import Paper as Paper
from gears3d.verification.papers.published import Result as Result
from gears3d.verification.papers.published import hold as hold
from gears3d.verification.papers.published import paper as paper
from gears3d.verification.papers.published import papers as papers
from gears3d.verification.papers.published import verdict as verdict
