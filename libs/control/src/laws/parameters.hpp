#pragma once
#include <limits>

#include "whirl/control/method.hpp"
#include "whirl/control/power.hpp"

namespace whirl::control {

// Parameters and settings that several laws share.
constexpr double kDerived = std::numeric_limits<double>::quiet_NaN();

inline const ParameterInfo kSurface{
    "surface_gain", "1/s", "C of the sliding surface (length unit 1 mm)", 60, 0.1, 5000, 5, 1000};
inline const ParameterInfo kSwitching{
    "switching_gain", "m/s^2", "rho, must exceed the disturbance bound", 3, 1e-3, 1e3, 0.2, 20};
inline const ParameterInfo kLayer{"boundary_layer",
                                  "m/s",
                                  "eps; default h rho (n+1)^(n+1)/n^n for n samples of delay",
                                  kDerived,
                                  1e-6,
                                  1e3,
                                  0.005,
                                  1,
                                  [](const std::map<std::string, double>& v, double h, int n) {
                                    return boundary_layer_limit(h, v.at("switching_gain"), n);
                                  }};
inline const ParameterInfo kExponent{
    "exponent", "1", "r = q/p of the terminal surface; below 1/2 the law is unbounded on s = 0", 0.7, 0.5, 0.999,
    0.55,       0.98};
inline const ParameterInfo kDelta{
    "delta",
    "m",
    "regularisation length of the singular term; default from the loop gain limit",
    kDerived,
    1e-9,
    1e-2,
    2e-6,
    2e-4,
    [](const std::map<std::string, double>& v, double h, int n) {
      return std::clamp(regularisation_limit(h, v.at("surface_gain"), v.at("exponent"), v.at("length_scale"), n), 1e-9,
                        1e-2);
    }};
inline const ParameterInfo kLength{"length_scale", "m", "length unit L of the surface gain", 1e-3, 1e-9, 1e3, 0, 0};
inline const ParameterInfo kTau{
    "tau",    "s",  "time constant of the projection; default h (n+1)^(n+1)/n^n",
    kDerived, 1e-6, 1,
    1e-3,     5e-2, [](const std::map<std::string, double>&, double h, int n) { return h / smooth_gain_limit(n); }};
inline const ParameterInfo kKp{"kp",  "1/s^2", "proportional gain; negative takes stiffness away", 0, -1e7, 1e7,
                               -6000, 12000};
inline const ParameterInfo kKd{"kd", "1/s", "derivative gain", 60, 0, 1e5, 5, 1000};

inline const ParameterInfo kSlow{"speed_min", "rad/s", "no adaptation below this speed", 10, 0, 1e6, 0, 0};
inline const ParameterInfo kPerTime{"adaptation", "1/s", "mu of the update", 3, 0, 1e4, 0.3, 100};

/// Weights of the linear-quadratic laws.
std::vector<ParameterInfo> quadratic_weights();

inline const char* const kPhiLatex = R"(\varphi(x) = L\,\mathrm{sig}(x/L)^{r})";
inline const char* const kLinearLatex = R"(s = v + C x)";
inline const char* const kPdText = "     a = -kp x - kd v - d";
inline const char* const kPdLatex = R"(a = -k_p x - k_d v - d)";

/// Equations in one row.
inline std::string equations(std::initializer_list<std::string> lines) {
  std::string out;
  for (const std::string& line : lines) out += (out.empty() ? "" : ",\\quad ") + line;
  return out;
}

/// The same law on both axes.
template <class Law>
AnyLaw both(const Law& law) {
  return LateralLaw<Law>{law, law};
}

inline TerminalPower power_of(const Parameters& v, Regularisation regularisation) {
  return {v.at("exponent"), v.at("delta"), v.at("length_scale"), regularisation};
}

inline const char* const kBlended =
    "; linear plus\n   quadratic inside |x| < delta, where the slope of the power is unbounded";

}  // namespace whirl::control
