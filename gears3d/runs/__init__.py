"""The run folder of the contract: written under a temporary name and renamed, so that it is never incomplete."""

from gears3d.runs.bundle import Bundle as Bundle
from gears3d.runs.bundle import bundle as bundle
from gears3d.runs.folder import Run as Run
from gears3d.runs.folder import RunFolder as RunFolder
from gears3d.runs.folder import default_folder as default_folder
from gears3d.runs.folder import read_run as read_run
from gears3d.runs.summary import judge as judge
from gears3d.runs.summary import summarise as summarise
