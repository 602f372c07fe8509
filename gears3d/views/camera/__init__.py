"""The high-speed camera: teeth in mesh in still pictures over a period, and as a film in slow motion."""

from gears3d.views.camera.film import write_film as write_film
from gears3d.views.camera.film import write_tour as write_tour
from gears3d.views.camera.strip import Strip as Strip
from gears3d.views.camera.strip import camera as camera
from gears3d.views.camera.strip import section_svg as section_svg
from gears3d.views.camera.strip import strip as strip
from gears3d.views.camera.strip import write_strip as write_strip
from gears3d.views.camera.subject import Subject as Subject
from gears3d.views.camera.subject import measured as measured
from gears3d.views.camera.subject import shots as shots
from gears3d.views.camera.subject import subject as subject
from gears3d.views.plots.section import Look as Look
from gears3d.views.plots.section import Shot as Shot
