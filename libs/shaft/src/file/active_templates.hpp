#pragma once
#include <string_view>

namespace whirl::shaft {

// Rotor files with actuators.

// clang-format off
inline constexpr std::string_view kActiveCentrifuge =
    R"(# Overhung centrifuge on springs: two force actuators push its housing at the upper bearing.
[rotor]
name = "active overhung rotor"
vertical = true

[[material]]
name = "steel"
youngs_modulus_GPa = 210
shear_modulus_GPa = 81
density_kg_m3 = 7800
damping_time_us = 2

[[section]]
length_mm = 400
outer_mm = 23

[[disc]]
name = "armature"
position_mm = 120
mass_kg = 1
transverse_kgm2 = 0.004
polar_kgm2 = 0.004

[[disc]]
name = "bowl"
position_mm = 380
mass_kg = 6
transverse_kgm2 = 0.03
polar_kgm2 = 0.05

[[body]]
name = "motor"
position_mm = 120
mass_kg = 10
transverse_kgm2 = 0.08

[[bearing]]
name = "lower"
position_mm = 50
on = "motor"
stiffness_N_m = 2e7
damping_Ns_m = 100

[[bearing]]
name = "upper"
position_mm = 200
on = "motor"
stiffness_N_m = 2e7
damping_Ns_m = 100

[[mount]]
name = "lower springs"
body = "motor"
position_mm = 30
stiffness_N_m = 3e5
damping_Ns_m = 20

[[mount]]
name = "upper springs"
body = "motor"
position_mm = 210
stiffness_N_m = 3e5
damping_Ns_m = 20

[[unbalance]]
position_mm = 380
size_gmm = 60

[[unbalance]]
position_mm = 120
size_gmm = 110
angle_deg = 130

[[probe]]
name = "bowl x"
position_mm = 380

[[probe]]
name = "bowl y"
position_mm = 380
angle_deg = 90

[[probe]]
name = "upper x"
position_mm = 200

[[probe]]
name = "upper y"
position_mm = 200
angle_deg = 90

[[actuator]]
name = "x"
on = "motor"              # pushed; against = "ground" holds it
position_mm = 200
force_limit_N = 200

[[actuator]]
name = "y"
on = "motor"
position_mm = 200
angle_deg = 90
force_limit_N = 200
)";

inline constexpr std::string_view kLevitated =
    R"(# A disc between two magnetic bearings, which alone hold it: unstable without control.
[rotor]
name = "levitated rotor"
vertical = true

[[material]]
name = "steel"
youngs_modulus_GPa = 210
shear_modulus_GPa = 81
density_kg_m3 = 7800
damping_time_us = 5

[[section]]
length_mm = 600
outer_mm = 25

[[disc]]
name = "left journal"
position_mm = 60
outer_mm = 60
bore_mm = 25
thickness_mm = 40

[[disc]]
name = "disc"
position_mm = 330
outer_mm = 200
bore_mm = 25
thickness_mm = 25

[[disc]]
name = "right journal"
position_mm = 540
outer_mm = 60
bore_mm = 25
thickness_mm = 40

[[unbalance]]
position_mm = 330
size_gmm = 30

[[actuator]]               # a magnet pair; its bias current pulls
name = "left x"
position_mm = 60
angle_deg = 0
force_limit_N = 200
bias_stiffness_N_m = -2e5

[[probe]]
name = "left x"
position_mm = 90
angle_deg = 0

[[actuator]]
name = "left y"
position_mm = 60
angle_deg = 90
force_limit_N = 200
bias_stiffness_N_m = -2e5

[[probe]]
name = "left y"
position_mm = 90
angle_deg = 90

[[actuator]]
name = "right x"
position_mm = 540
angle_deg = 0
force_limit_N = 200
bias_stiffness_N_m = -2e5

[[probe]]
name = "right x"
position_mm = 510
angle_deg = 0

[[actuator]]
name = "right y"
position_mm = 540
angle_deg = 90
force_limit_N = 200
bias_stiffness_N_m = -2e5

[[probe]]
name = "right y"
position_mm = 510
angle_deg = 90
)";
// clang-format on

}  // namespace whirl::shaft
