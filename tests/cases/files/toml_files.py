"""Component and mechanism files."""

SOLID = """\
[geometry]
file = "part.geo"
unit = "mm"
[geometry.parameters]
lc = "4 mm"
n = 3
angle = "90 deg"
[material]
E = "210 GPa"
nu = 0.3
rho = "7.85 g/cm^3"
"""

PENDULUM = """\
name = "pendulum"
gravity = [0, "-9.81 m/s^2", 0]

[bodies.bob]
mass = "2 kg"
inertia = ["0.01 kg m^2", 0.02, 0.025]
at = ["50 cm", 0, 0]
markers = { top = ["-500 mm", 0, 0] }

[joints.pivot]
kind = "revolute"
between = [{ ground = [0, 0, 0] }, "bob.top"]
axis = [0, 0, 1]

[simulation]
t_end = "0.5 s"
dt = "0.5 ms"
rho_inf = 1
"""

CRANK = """\
gravity = [0, "-9.81 m/s^2", 0]

[ground]
shaft = [0, 0, 0]
end = ["1.1 m", 0, 0]

[bodies.crank]
mass = "1 kg"
inertia = [1e-3, 1e-3, 2e-3]
at = ["50 mm", 0, 0]
markers = { shaft = ["-50 mm", 0, 0], pin = ["50 mm", 0, 0] }

[bodies.rod]
file = "rod.rom.npz"
at = ["100 mm", "-50 mm", "-40 mm"]

[bodies.slider]
mass = "300 g"
inertia = [1e-4, 1e-4, 1e-4]
at = ["1100 mm", 0, 0]
markers.pin = [0, 0, 0]

[joints]
"main bearing" = { kind = "revolute", between = ["ground.shaft", "crank.shaft"], axis = [0, 0, 1] }
"crank pin" = { kind = "revolute", between = ["crank.pin", "rod.root"], axis = [0, 0, 1] }
"wrist pin" = { kind = "revolute", between = ["rod.tip", "slider.pin"], axis = [0, 0, 1] }
guide = { kind = "prismatic", between = ["ground.end", "slider.pin"], axis = [1, 0, 0] }

[drives.motor]
joint = "main bearing"
law = { kind = "run-up", rate = "1200 rpm", duration = "20 ms" }

[forces.gas]
marker = "slider.pin"
vector = ["-50 N", 0, 0]
factor = { kind = "harmonic", amplitude = 1, frequency = "20 Hz" }

[simulation]
t_end = "10 ms"
dt = "0.1 ms"
rho_inf = 0.8
"""

ALL = """\
gravity = [0, 0, "-9.81 m/s^2"]
[ground]
o = [0, 0, 0]
[bodies.a]
file = "rod.rom.npz"
rigid = true
orientation = { axis = [0, 0, 1], angle = "90 deg" }
omega = [0, 0, "60 rpm"]
[bodies.b]
mass = 1
inertia = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
at = [1, 2, 3]
markers = { p = [0, 0, 0], q = [0, 0, 1] }
[bodies.c]
mass = 1
inertia = [1, 1, 1]
at = [4, 2, 3]
spin = [0, 0, 500]
markers = { p = [0, 0, 0] }
[joints]
gear = { kind = "gear", joint1 = "turn", joint2 = "slide", ratio = 0.1 }
turn = { kind = "revolute", between = ["ground.o", "b.p"], axis = [0, 0, 1] }
slide = { kind = "prismatic", between = ["ground.o", "c.p"], axis = [1, 0, 0] }
ball = { kind = "distance", between = ["a.tip", "b.q"], length = "3 m" }
[springs.s]
between = ["a.root", "c.p"]
stiffness = "2 kN/m"
damping = "3 N s/m"
free_length = "10 cm"
[rotational_springs.r]
joint = "turn"
stiffness = "5 N m/rad"
free_angle = "180 deg"
[motors]
t = { joint = "turn", law = "7 N m" }
f = { joint = "slide", law = { kind = "ramp", to = "2 kN", duration = "1 s" } }
[bushings.u]
between = ["a.root", "b.p"]
stiffness = ["1 kN/m", "2 kN/m", "3 kN/m"]
turning_stiffness = ["1 N m/rad", 2, 3]
[tendons.rope]
path = ["ground.o", "a.tip", "b.q"]
EA = "2 kN"
damping = "3 N s"
free_length = { kind = "steady", start = "4 m", rate = "-10 cm/s" }
friction = 0.2
transition_speed = "1 mm/s"
[tendons.rope.pulleys."a.tip"]
radius = "2 cm"
axis = [0, 0, 1]
friction = 0.1
[torques.w]
marker = "b.q"
vector = [0, 0, "1 N m"]
frame = "body"
[frictions.d]
joint = "slide"
transition_speed = "1 mm/s"
coulomb = "4 N"
[stops.e]
joint = "turn"
upper = "45 deg"
stiffness = 1e4
restitution = 0.5
impact_speed = "2 m/s"
[contacts.k]
kind = "sphere_on_plane"
between = ["ground.o", "c.p"]
normal = [0, 0, 1]
radius = "5 cm"
stiffness = 1e6
[simulation]
t_end = 1
"""


def laid_out(folder, rod):
    """The folder with both mechanism files and a link to the body that they name."""
    (folder / "rod.rom.npz").symlink_to(rod)
    (folder / "crank.toml").write_text(CRANK)
    (folder / "pendulum.toml").write_text(PENDULUM)
    return folder
