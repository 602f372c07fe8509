"""How the restitution coefficient changes the rattle of figure 5 (20 rpm, 3 Hz): twin against engine."""

from pathlib import Path

import gears3d as g3

base = g3.load(Path(__file__).with_name("fig5-20rpm.toml"))
print("   e   impacts  active mm/s  reverse mm/s  median error")
for e in (0.0, 0.3, 0.5, 0.7):
    scenario = base.with_({"impact.restitution": e, "run.duration": "2 s"})
    engine, twin = g3.simulate(scenario), g3.simulate(scenario, model="rigid")
    impacts = engine.impacts
    speed = [abs(impacts["velocity_m_s"][impacts["flank"] == flank]).mean() * 1e3 for flank in (0, 1)]
    error = g3.compare(engine, twin).velocity_error_median
    print(f"{e:5.1f}  {len(impacts['time_s']):7d}  {speed[0]:11.2f}  {speed[1]:12.2f}  {error:12.1e}")
