#include "parameters.hpp"

namespace whirl::control {

LawEntry pid_law() {
  return {.info = {"pid",
                   "proportional-integral-derivative",
                   "clamped integrator",
                   {kKp,
                    kKd,
                    {"ki", "1/s^3", "integral gain", 1000, 0, 1e8, 10, 1e5},
                    {"integral_limit", "m/s^2", "bound of the integral part", 5, 0, 1e3, 0, 0}}},
          .equation = "     a = -kp x - kd v - i - d,  i' = ki x,  |i| <= integral_limit",
          .latex = equations({R"(a = -k_p x - k_d v - i - d)", R"(\dot i = k_i x)", R"(|i| \le i_{\max})"}),
          .make =
              [](const ControllerDesign& d, const Parameters& v) {
                return both(Pid{v.at("kp"), v.at("kd"), v.at("ki"), v.at("integral_limit"), d.sample_time});
              },
          .code =
              [](const Parameters&) {
                return CodeFragment{"pid", {}, {}, "m/s^2, integral part"};
              },
          .model_free = true};
}

}  // namespace whirl::control
