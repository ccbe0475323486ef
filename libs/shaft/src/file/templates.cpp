#include <fmt/format.h>

#include <array>

#include "file/active_templates.hpp"
#include "whirl/core/error.hpp"
#include "whirl/shaft/rotor_file.hpp"

namespace whirl::shaft {
namespace {

struct Template {
  std::string_view name, text;
};

// clang-format off
constexpr std::string_view kJeffcott =
    R"(# One disc midway between two bearings.
[rotor]
name = "Jeffcott rotor"

[[material]]
name = "steel"
youngs_modulus_GPa = 211
shear_modulus_GPa = 81.2
density_kg_m3 = 7810

[[section]]
length_mm = 500
outer_mm = 12

[[disc]]
name = "disc"
position_mm = 250
outer_mm = 120
bore_mm = 12
thickness_mm = 20

[[bearing]]
name = "left"
position_mm = 0
stiffness_N_m = 2e6
damping_Ns_m = 200

[[bearing]]
name = "right"
position_mm = 500
stiffness_N_m = 2e6
damping_Ns_m = 200

[[unbalance]]
position_mm = 250
size_gmm = 20

[[probe]]
name = "x"
position_mm = 250

[[probe]]
name = "y"
position_mm = 250
angle_deg = 90
)";

constexpr std::string_view kTwoDisc =
    R"(# Two discs between soft bearings: example 5.9.2 of Friswell, Penny, Garvey and Lees,
# Dynamics of Rotating Machines (2010), with damping.
[rotor]
name = "two discs"
shear = "cowper"          # or hutchinson, none; a number: shear_coefficient = 0.9

[[material]]
name = "steel"
youngs_modulus_GPa = 211
shear_modulus_GPa = 81.2
density_kg_m3 = 7810

[[section]]
length_mm = 1500
outer_mm = 50

[[disc]]
name = "left disc"
position_mm = 500
outer_mm = 280
bore_mm = 50
thickness_mm = 70

[[disc]]
name = "right disc"
position_mm = 1000
outer_mm = 350
bore_mm = 50
thickness_mm = 70

[[bearing]]
name = "left"
position_mm = 0
stiffness_x_N_m = 1e6
stiffness_y_N_m = 0.8e6
damping_Ns_m = 100

[[bearing]]               # coefficients over speed: arrays, one value a speed
name = "right"
position_mm = 1500
speed_rpm = [0, 5000]
stiffness_x_N_m = [1e6, 1e6]
stiffness_y_N_m = [0.8e6, 0.8e6]
damping_Ns_m = [100, 100]

[[unbalance]]
position_mm = 500
size_gmm = 100

[[probe]]
name = "left x"
position_mm = 500

[[probe]]
name = "left 45"
position_mm = 500
angle_deg = 45
)";

constexpr std::string_view kOverhung =
    R"(# A disc outside its bearings, as of a fan or a compressor: example 5.9.9 of Friswell and others, 2010, with damping.
[rotor]
name = "overhung disc"

[[material]]
name = "steel"
youngs_modulus_GPa = 211
shear_modulus_GPa = 81.2
density_kg_m3 = 7810
damping_time_us = 2       # of the material; turns with the shaft

[[section]]
length_mm = 1500
outer_mm = 50

[[disc]]
name = "impeller"
position_mm = 1500
outer_mm = 350
bore_mm = 50
thickness_mm = 70

[[bearing]]
name = "left"
position_mm = 0
stiffness_N_m = 1e7
damping_Ns_m = 500

[[bearing]]
name = "right"
position_mm = 1000
stiffness_N_m = 1e7
damping_Ns_m = 500

[[unbalance]]
position_mm = 1500
size_gmm = 100

[[probe]]
name = "impeller"
position_mm = 1500
)";

constexpr std::string_view kCentrifuge =
    R"(# Laboratory centrifuge: a bowl on a thin spindle, a motor on rubber mounts.
[rotor]
name = "centrifuge"
vertical = true

[[material]]
name = "steel"
youngs_modulus_GPa = 210
shear_modulus_GPa = 81
density_kg_m3 = 7800

[[section]]               # armature
length_mm = 200
outer_mm = 50

[[section]]               # spindle
length_mm = 140
outer_mm = 12

[[section]]               # hub
length_mm = 20
outer_mm = 50

[[disc]]
name = "armature"
position_mm = 100
mass_kg = 1
transverse_kgm2 = 0.004
polar_kgm2 = 0.004

[[disc]]
name = "bowl"
position_mm = 340
offset_mm = 40            # centre of mass above the hub
mass_kg = 8
transverse_kgm2 = 0.055
polar_kgm2 = 0.085

[[body]]
name = "motor"
position_mm = 100
mass_kg = 5
transverse_kgm2 = 0.026

[[bearing]]
name = "lower"
position_mm = 20
on = "motor"
stiffness_N_m = 5e7

[[bearing]]
name = "upper"
position_mm = 180
on = "motor"
stiffness_N_m = 5e7

[[mount]]
name = "lower mounts"
body = "motor"
position_mm = 0
stiffness_N_m = 6e4
damping_Ns_m = 60

[[mount]]
name = "upper mounts"
body = "motor"
position_mm = 200
stiffness_N_m = 6e4
damping_Ns_m = 60

[[joint]]                 # fit of bowl and spindle; turns with them and makes the rotor unstable at high speed
from_mm = 200
to_mm = 340
damping_Nms_rad = 0.1

[[unbalance]]             # 10 g too much in one bucket
position_mm = 360
mass_gram = 10
radius_mm = 90

[[probe]]
name = "hub"
position_mm = 340

[[accelerometer]]         # on the housing; positions run upwards
name = "housing"
on = "motor"
position_mm = 200

[centrifuge]              # for `whirl centrifuge`
plane_mm = 360            # of the buckets
radius_mm = 90
buckets = 4               # bucket 1 at first_bucket_deg = 0 from the mark, with the rotation
allowed_gram = 3          # imbalance with which it may pass its critical speeds
load_gram = 400           # tubes in all buckets together, at most
mount_stiffness_percent = 10
mount_damping_percent = 50
sensor_gain_percent = 3
sensor_angle_deg = 2
)";

constexpr std::string_view kKit =
    R"(# Demonstration kit with two discs on a 10 mm shaft (dimensions as published for a Bently RK-4).
[rotor]
name = "rotor kit"

[[material]]
name = "steel"
youngs_modulus_GPa = 211
shear_modulus_GPa = 81.2
density_kg_m3 = 7810

[[section]]
length_mm = 560
outer_mm = 10

[[disc]]
name = "disc A"
position_mm = 160
mass_kg = 0.8
transverse_kgm2 = 3.355e-4
polar_kgm2 = 5.876e-4

[[disc]]
name = "disc B"
position_mm = 400
mass_kg = 0.8
transverse_kgm2 = 3.355e-4
polar_kgm2 = 5.876e-4

[[bearing]]
name = "left"
position_mm = 0
stiffness_N_m = 1e6
damping_Ns_m = 100

[[bearing]]
name = "right"
position_mm = 560
stiffness_N_m = 1e6
damping_Ns_m = 100

[[unbalance]]
position_mm = 160
mass_gram = 0.4
radius_mm = 30

[[probe]]
name = "left x"
position_mm = 120
angle_deg = 0

[[probe]]
name = "left y"
position_mm = 120
angle_deg = 90

[[probe]]
name = "right x"
position_mm = 440

[[probe]]
name = "right y"
position_mm = 440
angle_deg = 90
)";

// clang-format on
constexpr std::array kRotorTemplates{Template{"jeffcott", kJeffcott},
                                     Template{"two-disc", kTwoDisc},
                                     Template{"overhung", kOverhung},
                                     Template{"centrifuge", kCentrifuge},
                                     Template{"kit", kKit},
                                     Template{"active-centrifuge", kActiveCentrifuge},
                                     Template{"levitated", kLevitated}};

}  // namespace

std::vector<std::string> rotor_templates() {
  std::vector<std::string> names;
  for (const Template& t : kRotorTemplates) names.emplace_back(t.name);
  return names;
}

std::string rotor_template(std::string_view name) {
  for (const Template& t : kRotorTemplates)
    if (t.name == name) return std::string(t.text);
  throw Error::in_field("template", name, fmt::format("{}", fmt::join(rotor_templates(), ", ")));
}

}  // namespace whirl::shaft
