#pragma once
#include <map>
#include <string>
#include <vector>

#include "whirl/lagrange/derive.hpp"

namespace whirl::lagrange {

using Values = std::map<std::string, double, std::less<>>;

inline PhysicalParameter parameter(const char* name, const char* unit) { return {name, unit, {}}; }

/// Paper eqs. 2 and 12: disk with centre of mass G at distance e from C, J = J_bar + m e^2 about C.
inline LagrangeProblem paper_rotor() {
  LagrangeProblem p;
  p.coordinates = {"x", "y", "b"};
  p.inputs = {"Ux", "Uy", "tau"};
  p.parameters = {parameter("m", "kg"),     parameter("J", "kg m^2"), parameter("e", "m"),     parameter("K1", "N/m"),
                  parameter("K2", "N/m^3"), parameter("Cx", "N s/m"), parameter("Cy", "N s/m")};
  p.kinetic = "m*((x' - e*sin(b)*b')^2 + (y' + e*cos(b)*b')^2)/2 + (J - m*e^2)*b'^2/2";
  p.potential = "K1*(x^2 + y^2)/2 + K2*(x^2 + y^2)^2/4";
  p.rayleigh = "Cx*x'^2/2 + Cy*y'^2/2";
  p.forces = {{"x", "Ux"}, {"y", "Uy"}, {"b", "tau"}};
  return p;
}

/// The same with a measured angle, an unbalance at the angle phi, equal damping, paper state names (eq. 22).
inline LagrangeProblem tied_rotor() {
  LagrangeProblem p;
  p.coordinates = {"x", "y"};
  p.prescribed = {{"b", ""}};
  p.inputs = {"ux", "uy"};
  p.parameters = {parameter("m", "kg"),   parameter("e", "m"),      parameter("phi", "rad"),
                  parameter("K1", "N/m"), parameter("K2", "N/m^3"), parameter("C", "N s/m")};
  p.kinetic = "m*((x' - e*sin(b + phi)*b')^2 + (y' + e*cos(b + phi)*b')^2)/2";
  p.potential = "K1*(x^2 + y^2)/2 + K2*(x^2 + y^2)^2/4";
  p.rayleigh = "C*(x'^2 + y'^2)/2";
  p.forces = {{"x", "ux"}, {"y", "uy"}};
  p.names = {{"x", "X1"}, {"x'", "X2"}, {"y", "X3"}, {"y'", "X4"}, {"b", "X5"}, {"b'", "X6"}, {"b''", "X7"}};
  return p;
}

inline LagrangeProblem duffing_oscillator() {
  LagrangeProblem p;
  p.coordinates = {"x"};
  p.inputs = {"u"};
  p.parameters = {parameter("m", "kg"), parameter("c", "N s/m"), parameter("k", "N/m"), parameter("k3", "N/m^3")};
  p.kinetic = "m*x'^2/2";
  p.potential = "k*x^2/2 + k3*x^4/4";
  p.rayleigh = "c*x'^2/2";
  p.forces = {{"x", "u"}};
  return p;
}

inline LagrangeProblem simple_pendulum() {
  LagrangeProblem p;
  p.coordinates = {"a"};
  p.parameters = {parameter("m", "kg"), parameter("l", "m"), parameter("g", "m/s^2"), parameter("c", "N m s")};
  p.kinetic = "m*l^2*a'^2/2";
  p.potential = "-m*g*l*cos(a)";
  p.rayleigh = "c*a'^2/2";
  return p;
}

inline LagrangeProblem two_masses() {
  LagrangeProblem p;
  p.coordinates = {"x", "y"};
  p.parameters = {parameter("m1", "kg"), parameter("m2", "kg"), parameter("k1", "N/m"), parameter("k2", "N/m")};
  p.kinetic = "m1*x'^2/2 + m2*y'^2/2";
  p.potential = "k1*x^2/2 + k2*(y - x)^2/2";
  return p;
}

/// Bearings softer in one direction, at an angle alpha to the probes.
inline LagrangeProblem anisotropic_rotor() {
  LagrangeProblem p = tied_rotor();
  p.parameters.push_back(parameter("dK", "N/m"));
  p.parameters.push_back(parameter("alpha", "rad"));
  p.potential += " + dK*((x*cos(alpha) + y*sin(alpha))^2 - (y*cos(alpha) - x*sin(alpha))^2)/4";
  return p;
}

inline LagrangeProblem cart_pendulum() {
  LagrangeProblem p;
  p.coordinates = {"x", "a"};
  p.inputs = {"F"};
  p.parameters = {parameter("M", "kg"), parameter("m", "kg"), parameter("l", "m"), parameter("g", "m/s^2")};
  p.kinetic = "M*x'^2/2 + m*((x' + l*cos(a)*a')^2 + (l*sin(a)*a')^2)/2";
  p.potential = "-m*g*l*cos(a)";
  p.forces = {{"x", "F"}};
  return p;
}

/// Disk that tilts by u + i v = d(x + i y)/d(axial), speed b' measured (Green): libs/rotor GyroscopicRotor without chi.
inline LagrangeProblem gyroscopic_rotor() {
  LagrangeProblem p;
  p.coordinates = {"x", "y", "u", "v"};
  p.prescribed = {{"b", ""}};
  p.parameters = {parameter("m", "kg"),    parameter("Id", "kg m^2"), parameter("Ip", "kg m^2"),
                  parameter("e", "m"),     parameter("k11", "N/m"),   parameter("k12", "N"),
                  parameter("k22", "N m"), parameter("c11", "N s/m"), parameter("c22", "N m s")};
  p.kinetic = "m*((x' - e*sin(b)*b')^2 + (y' + e*cos(b)*b')^2)/2 + Id*(u'^2 + v'^2)/2 + Ip*(b'^2 + b'*(v*u' - u*v'))/2";
  p.forces = {{"u", "Ip*b''*v/2"}, {"v", "-Ip*b''*u/2"}};  // the driving torque Ip b'' turns with the tilted axis
  p.potential = "k11*(x^2 + y^2)/2 + k12*(x*u + y*v) + k22*(u^2 + v^2)/2";
  p.rayleigh = "c11*(x'^2 + y'^2)/2 + c22*(u'^2 + v'^2)/2";
  return p;
}

inline std::vector<LagrangeProblem> all_systems() {
  return {paper_rotor(), tied_rotor(),        duffing_oscillator(), simple_pendulum(),
          two_masses(),  anisotropic_rotor(), cart_pendulum(),      gyroscopic_rotor()};
}

}  // namespace whirl::lagrange
