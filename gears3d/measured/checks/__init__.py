"""The sensor gate: faults of the encoders and the file, before any statement about the gears."""

from gears3d.measured.checks.admission import Admission as Admission
from gears3d.measured.checks.admission import Admitted as Admitted
from gears3d.measured.checks.admission import admit as admit
from gears3d.measured.checks.admission import admit_all as admit_all
from gears3d.measured.checks.admission import admit_each as admit_each
from gears3d.measured.checks.admission import told as told
from gears3d.measured.checks.examination import CORRECTABLE as CORRECTABLE
from gears3d.measured.checks.examination import correct as correct
from gears3d.measured.checks.examination import examine as examine
from gears3d.measured.checks.view import Finding as Finding
