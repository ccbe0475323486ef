#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "whirl/control/catalogue.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/core/error.hpp"

namespace whirl::control {
namespace {

using Values = std::map<std::string, double>;

template <class Law>
AnyLaw both(const Law& law) {
  return LateralLaw<Law>{law, law};
}

TerminalPower power_of(const Values& v, Regularisation regularisation) {
  return {v.at("exponent"), v.at("delta"), v.at("length_scale"), regularisation};
}

AnyLaw make_sliding(const std::string& law, const Values& v, double h) {
  const double c = v.at("surface_gain");
  if (law == "sta" || law == "sta_implicit") {
    return both(SuperTwistingSmc{c, {v.at("twisting_rate"), v.at("twisting_limit")}, h, law == "sta_implicit"});
  }
  if (law == "asmc") {
    return both(AdaptiveSmc{c, v.at("boundary_layer"), v.at("adaptation_rate"), v.at("dead_zone"), v.at("gain_min"),
                            v.at("gain_max"), h, v.at("gain_min")});
  }
  if (law == "bsmc") return both(BarrierSmc{c, v.at("barrier_width"), v.at("barrier_gain"), v.at("gain_max")});
  const double rho = v.at("switching_gain");
  if (law == "smc_implicit") return both(ImplicitSmc{c, rho, v.at("tau")});
  if (law == "tsmc_implicit") {
    return both(ImplicitTerminalSmc{c, rho, v.at("tau"), v.at("exponent"), v.at("length_scale"), h});
  }
  const double eps = v.at("boundary_layer");
  if (law == "lsmc") return both(LinearSmc{c, rho, eps});
  if (law == "ntsmc") return both(NonsingularTerminalSmc{c, rho, eps, v.at("exponent"), v.at("length_scale")});
  if (law == "nftsmc") {
    return both(NonsingularFastTerminalSmc{c, rho, eps, v.at("exponent"), v.at("length_scale"), v.at("fast_gain"),
                                           v.at("fast_exponent")});
  }
  if (law == "ftsmc") {
    return both(FastTerminalSmc{v.at("linear_gain"), c, rho, eps, power_of(v, Regularisation::blend)});
  }
  if (law == "tsmc") return both(TerminalSmc{c, rho, eps, power_of(v, Regularisation::blend)});
  // tsmc_paper: printed, or with the clamp when a delta is given.
  const auto kind = v.at("delta") > 0 ? Regularisation::clamp : Regularisation::none;
  return both(TerminalSmc{c, rho, eps, power_of(v, kind)});
}

AnyLaw make_law(const ControllerDesign& d, const Values& v) {
  const double h = d.sample_time;
  if (d.law == "pd") return both(Pd{v.at("kp"), v.at("kd")});
  if (d.law == "pid") return both(Pid{v.at("kp"), v.at("kd"), v.at("ki"), v.at("integral_limit"), h});
  if (d.law == "lqr") {
    const LqrGains g =
        lqr_gains(d.model.k1, d.model.c, h, v.at("position_scale"), v.at("velocity_scale"), v.at("control_scale"));
    return both(Pd{g.kp, g.kd});
  }
  if (d.law == "mpc") {
    const auto axis = [&](double k1, double c) {
      const LqrGains g = lqr_gains(k1, c, h, v.at("position_scale"), v.at("velocity_scale"), v.at("control_scale"));
      const int horizon = static_cast<int>(v.at("horizon"));
      return ModelPredictive{BoundedRegulator(sample_axis(k1, c, h), g.kp, g.kd, horizon), g.kp, g.kd,
                             d.model.gain * d.force_limit, h};
    };
    const double split_k = d.model.k1_conj.real(), split_c = d.model.c_conj.real();
    return LateralLaw<ModelPredictive>{axis(d.model.k1 + split_k, d.model.c + split_c),
                                       axis(d.model.k1 - split_k, d.model.c - split_c)};
  }
  if (d.law.starts_with("pd_")) {
    using Method = SynchronousCanceller::Method;
    const Method method = d.law == "pd_influence" ? Method::influence
                          : d.law == "pd_fxlms"   ? Method::fxlms
                                                  : Method::notch;
    const double delay = v.at("predict") > 0 ? 0 : d.delay + 0.5 * h;
    const Pd pd{v.at("kp"), v.at("kd")};
    return SynchronousPd{pd, pd,
                         SynchronousCanceller(method, v.at("adaptation"), pd.kp, pd.kd, LateralModel::from(d.model),
                                              delay, h, v.at("speed_min"))};
  }
  return make_sliding(d.law, v, h);
}

AnyEstimator make_estimator(const ControllerDesign& d, const Values& v) {
  const double h = d.sample_time;
  const LateralModel model = LateralModel::from(d.model);
  if (d.estimator == "difference") return FilteredDifference(std::numeric_limits<double>::infinity(), h);
  if (d.estimator == "lpf") return FilteredDifference(v.at("cutoff"), h);
  if (d.estimator == "red") return LevantDifferentiator(v.at("derivative_rate"), h, false);
  if (d.estimator == "red_implicit") return LevantDifferentiator(v.at("derivative_rate"), h, true);
  if (d.estimator == "eso") return ExtendedStateObserver(model, v.at("bandwidth"), h);
  KalmanOptions options{v.at("measurement_noise"), v.at("acceleration_noise"), 0, 0};
  DisturbanceState kind = DisturbanceState::none;
  if (d.estimator == "kfe") {
    kind = DisturbanceState::eccentricity;
    options.disturbance_walk = v.at("eccentricity_walk");
    options.disturbance_prior = v.at("eccentricity_prior");
  } else if (d.estimator == "kfo") {
    kind = DisturbanceState::oscillator;
    options.disturbance_walk = v.at("oscillator_walk");
    options.disturbance_prior = v.at("oscillator_prior");
  }
  return KalmanEstimator(model, kind, d.model.eps, options, h);
}

Runout make_runout(const Values& v) {
  Runout r;
  for (std::size_t k = 0; k < Runout::kHarmonics; ++k) {
    r.x_cos[k] = v.at(fmt::format("runout_x_cos_{}", k + 1));
    r.x_sin[k] = v.at(fmt::format("runout_x_sin_{}", k + 1));
    r.y_cos[k] = v.at(fmt::format("runout_y_cos_{}", k + 1));
    r.y_sin[k] = v.at(fmt::format("runout_y_sin_{}", k + 1));
  }
  return r;
}

}  // namespace

Controller make_controller(const ControllerDesign& design) {
  const Values v = resolve_parameters(design);
  const RotorModel& m = design.model;
  if (!(m.gain > 0) || !std::isfinite(m.gain)) {
    throw Error::in_field(
        "model.gain", fmt::format("{:g} 1/kg", m.gain),
        "positive and finite: the acceleration per newton of actuator force is needed (weigh the rotor "
        "or fit the gain from a record with control)");
  }
  if (!std::isfinite(m.k1 + m.k2 + m.c + std::abs(m.k1_conj) + std::abs(m.c_conj) + std::abs(m.eps) +
                     std::abs(m.offset))) {
    throw Error("model of the controller: a coefficient is not finite");
  }
  require_range("force_limit", design.force_limit, 0, 1e9, "N");

  ControllerSettings s;
  s.model = LateralModel::from(m);
  s.eps = m.eps;
  s.offset = m.offset;
  s.gain = m.gain;
  s.sample_time = design.sample_time;
  s.delay = design.delay;
  s.sensor_delay = v.at("sensor_delay");
  s.force_limit = design.force_limit;
  s.cancel = v.at("cancel");
  s.feedforward = design.feedforward;
  s.advance = v.at("advance") > 0;
  s.predict = v.at("predict") > 0;
  s.stale_limit = static_cast<long>(v.at("stale_limit"));
  SampleGate gate;
  gate.range = v.at("sensor_range");
  gate.jump = v.at("jump_limit");
  return Controller(s, make_estimator(design, v), make_law(design, v), gate, make_runout(v));
}

LqrGains lqr_gains(double k1, double c, double h, double x_scale, double v_scale, double a_scale) {
  const SampledAxis axis = sample_axis(k1, c, h);
  const double a00 = axis.a00, a01 = axis.a01, a10 = axis.a10, a11 = axis.a11, b0 = axis.b0, b1 = axis.b1;
  const double q0 = 1 / (x_scale * x_scale), q1 = 1 / (v_scale * v_scale), r = 1 / (a_scale * a_scale);
  double p00 = q0, p01 = 0, p11 = q1;
  LqrGains out;
  const auto iterate = [&](double& n00, double& n01, double& n11) {
    const double pb0 = p00 * b0 + p01 * b1, pb1 = p01 * b0 + p11 * b1, s = r + b0 * pb0 + b1 * pb1;
    out.kp = (pb0 * a00 + pb1 * a10) / s;
    out.kd = (pb0 * a01 + pb1 * a11) / s;
    const double m00 = p00 * a00 + p01 * a10, m01 = p00 * a01 + p01 * a11;
    const double m10 = p01 * a00 + p11 * a10, m11 = p01 * a01 + p11 * a11;
    n00 = a00 * m00 + a10 * m10 - s * out.kp * out.kp + q0;
    n01 = a00 * m01 + a10 * m11 - s * out.kp * out.kd;
    n11 = a01 * m01 + a11 * m11 - s * out.kd * out.kd + q1;
  };
  for (int i = 0; i < 200000; ++i) {
    double n00, n01, n11;
    iterate(n00, n01, n11);
    const double change = std::abs(n00 - p00) / n00 + std::abs(n11 - p11) / n11;
    p00 = n00, p01 = n01, p11 = n11;
    if (change < 1e-14) break;
  }
  double n00, n01, n11;
  iterate(n00, n01, n11);
  out.residual = std::max({std::abs(n00 - p00) / p00, std::abs(n01 - p01) / p00, std::abs(n11 - p11) / p11});
  const double c00 = a00 - b0 * out.kp, c01 = a01 - b0 * out.kd, c10 = a10 - b1 * out.kp, c11 = a11 - b1 * out.kd;
  const double half = 0.5 * (c00 + c11), det = c00 * c11 - c01 * c10, disc = half * half - det;
  out.spectral_radius = disc >= 0 ? std::abs(half) + std::sqrt(disc) : std::sqrt(det);
  return out;
}

}  // namespace whirl::control
