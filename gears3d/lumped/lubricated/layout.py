"""Where the numbers of the lubricated model's kernel stand."""

from __future__ import annotations

# numbers of the model
MASS, RADIUS_DRIVE, RADIUS_LOOSE, BACKLASH = 0, 1, 2, 3
WEDGE, SQUEEZE, ROLL_DRIVE, ROLL_LOOSE, FLOOR, FELT = 4, 5, 6, 7, 8, 9
THRESHOLD, DAMPING, FIXED_DAMPING, RAMP, PUBLISHED = 10, 11, 12, 13, 14
MEAN, TEETH, TORQUE, VISCOUS, CARRIED, RUBBING, SHEARING = 15, 16, 17, 18, 19, 20, 21
NUMBERS = 22

# columns of the table over one pitch of the drive: of both flanks, stiffness, lever of friction, lever of shearing oil
STIFFNESS, LEVER, SHEAR = 0, 2, 4
COLUMNS = 6

# state: time, displacement, its rate and acceleration, next step
TIME, PLACE, RATE, CHANGE, STEP = 0, 1, 2, 3, 4
# passage through the film of a flank: begin, speed, speed of the loose gear, whether it has turned, whether it stays
ENTRY, ENTRY_RATE, ENTRY_SPEED, TURNED, STAYS = 5, 6, 7, 8, 9
LEFT, HIGHEST = 10, 11  # the flank that was left last, and the largest distance from it since
FORCE, JERK, RISING = 12, 13, 14  # mesh force at the last point, integral of its rate squared, time over which
BOOKS = 15
MESH_WORK, DRAG_WORK, FRICTION_WORK, SPRING_WORK, DAMPING_WORK, SQUEEZE_WORK, WEDGE_WORK, DRIVE_WORK = range(8)
STATE = BOOKS + 8

# flags: what is frozen within a step
APPROACHING, INSIDE, NEAR = 0, 2, 4  # of both flanks: gap falls, below the threshold, below the felt height
FLAGS = 6

# counters
STEPS, REJECTED, EVENTS, TOUCHES, IMPACTS, CONTACTS, SAMPLES = 0, 1, 2, 3, 4, 5, 6
COUNTERS = 7

# parts of the force at a point
ACCELERATION, ACTIVE_FORCE, REVERSE_FORCE, OMEGA_DRIVE, OMEGA_LOOSE = 0, 1, 2, 3, 4
GAP, GAP_RATE = 5, 7  # of both flanks
POWER = 9  # mesh, drag, friction, spring, damping, squeeze, wedge, drive
PARTS = POWER + 8

DONE, FULL, BROKEN, STANDSTILL = 0, 1, 2, 3
