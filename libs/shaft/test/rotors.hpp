#pragma once
#include <numbers>
#include <string>
#include <vector>

#include "whirl/shaft/rotor.hpp"

namespace whirl::shaft::testing {

inline constexpr double kRpm = std::numbers::pi / 30;  // rad/s
inline constexpr double kHz = 2 * std::numbers::pi;    // rad/s

inline Section round_section(double length, double outer, double inner = 0, int elements = 1) {
  return {length, outer, outer, inner, inner, 0, elements};
}
inline Disc disc_at(double position, Disc d) {
  d.position = position;
  return d;
}
inline Support bearing_at(double position, const Eigen::Matrix2d& stiffness,
                          const Eigen::Matrix2d& damping = Eigen::Matrix2d::Zero()) {
  return {"", {"shaft", position}, {"ground", position}, {{}, {stiffness}, {damping}, {}}};
}
inline Eigen::Matrix2d diagonal(double x, double y) { return Eigen::Vector2d(x, y).asDiagonal(); }

/// Nelson and McVaugh, J. Eng. Ind. 98, 1976, 593-600: stepped shaft, overhung disc; no shear. Stations in cm.
inline Rotor nelson_mcvaugh(int elements = 1) {
  const std::vector<double> station{0,     1.27,  5.08,  7.62,  8.89,  10.16, 10.67, 11.43, 12.70, 13.46,
                                    16.51, 19.05, 22.86, 26.67, 28.70, 30.48, 31.50, 34.54, 35.55};
  const std::vector<double> outer{.51,  1.02, .76,  2.03, 2.03, 3.30, 3.30, 2.54, 2.54,
                                  1.27, 1.27, 1.52, 1.52, 1.27, 1.27, 3.81, 2.03, 2.03};
  const std::vector<double> inner{0, 0, 0, 0, 0, 0, 1.52, 1.78, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1.52};
  Rotor r;
  r.materials = {{"steel", 2.078e11, 2.078e11 / 2.6, 7806}};
  r.shear.model = ShearModel::none;
  for (std::size_t k = 0; k < outer.size(); ++k)
    r.sections.push_back(
        round_section((station[k + 1] - station[k]) * 1e-2, 2e-2 * outer[k], 2e-2 * inner[k], elements));
  r.discs = {{"disc", 8.89e-2, 1.401, 1.36e-3, 2.03e-3}};
  for (const double z : {16.51e-2, 28.70e-2}) r.supports.push_back(bearing_at(z, diagonal(4.378e7, 4.378e7)));
  return r;
}

/// Friswell, Penny, Garvey and Lees, Dynamics of Rotating Machines, 2010, example 5.9.1 and its relatives.
inline Rotor friswell(const Eigen::Matrix2d& stiffness, double damping = 0, int elements = 2,
                      ElementKind kind = ElementKind::usual) {
  Rotor r;
  r.materials = {{"steel", 2.11e11, 8.12e10, 7810}};
  r.shear.model = ShearModel::cowper;
  r.element = kind;
  r.sections.assign(3, round_section(0.5, 0.05, 0, elements));
  r.discs = {disc_at(0.5, cylinder(7810, 0.28, 0.05, 0.07)), disc_at(1.0, cylinder(7810, 0.35, 0.05, 0.07))};
  for (const double z : {0.0, 1.5}) r.supports.push_back(bearing_at(z, stiffness, diagonal(damping, damping)));
  return r;
}

/// The same book, example 5.9.9: a disc outside its bearings.
inline Rotor overhung(int elements_between, int elements_outside) {
  Rotor r;
  r.materials = {{"steel", 2.11e11, 8.12e10, 7810}};
  r.shear.model = ShearModel::cowper;
  r.element = ElementKind::usual;
  r.sections = {round_section(1.0, 0.05, 0, elements_between), round_section(0.5, 0.05, 0, elements_outside)};
  r.discs = {disc_at(1.5, cylinder(7810, 0.35, 0.05, 0.07))};
  for (const double z : {0.0, 1.0}) r.supports.push_back(bearing_at(z, diagonal(1e7, 1e7)));
  return r;
}

/// Lalanne and Ferraris, Rotordynamics Prediction in Engineering, 1998: three discs.
inline Rotor lalanne_ferraris(ElementKind kind = ElementKind::usual) {
  Rotor r;
  r.materials = {{"steel", 2e11, 2e11 / 2.6, 7800}};
  r.shear.model = ShearModel::cowper;
  r.element = kind;
  r.sections = {round_section(1.3, 0.1, 0, 13)};
  r.discs = {disc_at(0.2, cylinder(7800, 0.24, 0.1, 0.05)), disc_at(0.5, cylinder(7800, 0.40, 0.1, 0.05)),
             disc_at(1.0, cylinder(7800, 0.40, 0.1, 0.06))};
  for (const double z : {0.0, 1.3}) r.supports.push_back(bearing_at(z, diagonal(5e7, 7e7), diagonal(5e2, 7e2)));
  return r;
}

}  // namespace whirl::shaft::testing
