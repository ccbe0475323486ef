#include "whirl/identify/slow_roll.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "rules/rules.hpp"
#include "whirl/core/error.hpp"

namespace whirl::identification {
namespace {

using Complex = std::complex<double>;

double order_of(std::size_t k) { return (k % 2 == 0 ? 1.0 : -1.0) * static_cast<double>(k / 2 + 1); }

/// The angle and the readings alone: what a record must be to identify from does not matter here.
RotorRecord read(const Recording& record, RotorRecordOptions options) {
  options.check = false;
  return rotor_record(record, options);
}

void widen(Estimate& e, double to, double sd) {
  e.low = std::min(e.low, to - rules::k95 * sd);
  e.high = std::max(e.high, to + rules::k95 * sd);
  e.sd = std::max({e.sd, (e.value - e.low) / rules::k95, (e.high - e.value) / rules::k95});
}

Estimate* find(IdentifiedModel& model, const std::string& name) {
  for (auto& [own, e] : model.parameters) {
    if (own == name) return &e;
  }
  return nullptr;
}

/// A parameter beside the others; their joint covariance goes on.
void add_independent(IdentifiedModel& model, const std::string& name, const Estimate& e) {
  const std::size_t n = model.parameters.size(), more = n + 1;
  if (model.parameter_covariance.size() == n * n) {
    std::vector<double> joint(more * more, 0.0);
    for (std::size_t i = 0; i < n; ++i)
      std::copy_n(model.parameter_covariance.begin() + static_cast<std::ptrdiff_t>(i * n), n,
                  joint.begin() + static_cast<std::ptrdiff_t>(i * more));
    joint.back() = e.sd * e.sd;
    model.parameter_covariance = std::move(joint);
  }
  model.parameters.emplace_back(name, e);
}

/// Writes the vectors into the parameters and carries the meaning of the one at order 1 into e.
void state(const SlowRoll& roll, SlowRollMeaning meaning, Identification& id) {
  IdentifiedModel& model = id.model;
  for (std::size_t k = 0; k < roll.vectors.size(); ++k) {
    const std::string name = fmt::format("runout{}{}", k / 2 + 1, k % 2 == 0 ? "+" : "-");
    for (const auto& [part, value] : {std::pair("_re", roll.vectors[k].real()), {"_im", roll.vectors[k].imag()}}) {
      if (Estimate* left = find(model, name + part); left != nullptr) {
        *left = Estimate::from_sd(left->value + value, std::hypot(left->sd, roll.sd));
      } else {
        add_independent(model, name + part, Estimate::from_sd(value, roll.sd));
      }
    }
  }
  if (!model.rotor || meaning == SlowRollMeaning::runout) return;
  const double w = model.rotor->natural_frequency();
  const Complex shift = -roll.vectors[0] * Complex(1, -model.rotor->c / w);  // from runout to bow
  if (std::abs(shift) < rules::kVectorSeen * roll.sd) return;
  const Complex bowed = model.rotor->eps + shift;
  Estimate &e = *find(model, "e"), &phase = *find(model, "e_phase");
  const double turn = std::remainder(std::arg(bowed) - phase.value, 2 * std::numbers::pi);
  if (meaning == SlowRollMeaning::bow) {
    e = Estimate::from_sd(std::abs(bowed), std::hypot(e.sd, roll.sd));
    phase = Estimate::from_sd(std::arg(bowed), std::hypot(phase.sd, roll.sd / std::abs(bowed)));
    return;
  }
  Ambiguity open{
      fmt::format("the slow roll of {:.3g} um (at {:.1f} deg) is runout of the probe's track, or a bow of the shaft",
                  1e6 * std::abs(roll.vectors[0]), std::arg(roll.vectors[0]) * 180 / std::numbers::pi),
      fmt::format("e of the mass {:.4g} m at {:.1f} deg, or {:.4g} m at {:.1f} deg; what nulls the motion without the "
                  "slow roll is the same",
                  e.value, phase.value * 180 / std::numbers::pi, std::abs(bowed),
                  std::arg(bowed) * 180 / std::numbers::pi),
      "a slow roll on a second probe plane, or on a surface of known runout; then --slow-roll-reads"};
  Alternative bow{"bow of the shaft"};
  bow.parameters = {{"e", Estimate::from_sd(std::abs(bowed), e.sd)},
                    {"e_phase", Estimate::from_sd(std::arg(bowed), phase.sd)},
                    {"bow", Estimate::from_sd(std::abs(roll.vectors[0]), roll.sd)},
                    {"bow_phase", Estimate::from_sd(std::arg(roll.vectors[0]), roll.sd / std::abs(roll.vectors[0]))}};
  open.alternatives.push_back(std::move(bow));
  model.ambiguities.push_back(std::move(open));
  widen(e, std::abs(bowed), e.sd);
  widen(phase, phase.value + turn, phase.sd);
}

}  // namespace

SlowRollMeaning slow_roll_meaning(const std::string& name) {
  if (name == "unknown") return SlowRollMeaning::unknown;
  if (name == "runout") return SlowRollMeaning::runout;
  if (name == "bow") return SlowRollMeaning::bow;
  throw Error::in_field("slow roll", name, "unknown, runout, bow");
}

SlowRoll measure_slow_roll(const Recording& record, const RotorRecordOptions& options, int harmonics) {
  require_range("harmonics", harmonics, 1, 8);
  const RotorRecord r = read(record, options);
  if (r.turns() < 2) {
    throw Error(
        fmt::format("{}: the rotor turns {:.2g} times: a slow roll needs at least 2 turns", record.source, r.turns()));
  }
  const Eigen::Index n = r.size(), m = 2 + 2 * harmonics;
  Eigen::MatrixXcd base(n, m);
  for (Eigen::Index i = 0; i < n; ++i) {
    base(i, 0) = 1;
    base(i, 1) = static_cast<double>(i) / static_cast<double>(n) - 0.5;
    for (Eigen::Index k = 2; k < m; ++k) {
      base(i, k) = std::polar(1.0, order_of(static_cast<std::size_t>(k - 2)) * r.angle.beta[2 * i]);
    }
  }
  const Eigen::HouseholderQR<Eigen::MatrixXcd> qr(base);
  const Eigen::VectorXcd fit = qr.solve(r.z);
  SlowRoll roll;
  for (Eigen::Index k = 2; k < m; ++k) roll.vectors.push_back(fit[k]);
  roll.sd = std::sqrt((r.z - base * fit).squaredNorm() / (2 * static_cast<double>(n - m))) /
            std::sqrt(static_cast<double>(n));
  roll.speed = r.speed_high();
  return roll;
}

Recording without_slow_roll(const Recording& record, const SlowRoll& roll, const RotorRecordOptions& options) {
  RotorRecordOptions plain = options;
  plain.check = false;
  Recording finite = record;  // the angle is fitted whatever the probes read
  for (Channel& c : finite.channels) {
    if (c.name == options.x || c.name == options.y) c.samples = c.samples.array().isFinite().select(c.samples, 0.0);
  }
  const RotorRecord r = rotor_record(finite, plain);
  Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(r.size());
  for (Eigen::Index i = 0; i < sum.size(); ++i) {
    for (std::size_t k = 0; k < roll.vectors.size(); ++k) {
      sum[i] += roll.vectors[k] * std::polar(1.0, order_of(k) * r.angle.beta[2 * i]);
    }
  }
  Recording out = record;
  for (Channel& c : out.channels) {
    if (c.name == options.x) c.samples -= sum.real();
    if (c.name == options.y) c.samples -= sum.imag();
  }
  return out;
}

Identification identify_with_slow_roll(const std::vector<Recording>& records, const Recording& slow,
                                       const IdentifyOptions& options, SlowRollMeaning meaning) {
  if (records.empty()) throw Error("records: at least one is needed");
  if (options.chosen(records.front()) != Method::weak) throw Error("a slow roll is for rotors: --method weak");
  SlowRoll roll = measure_slow_roll(slow, options.rotor.record);
  const auto corrected = [&] {
    std::vector<Recording> out;
    for (const Recording& r : records) out.push_back(without_slow_roll(r, roll, options.rotor.record));
    return out;
  };
  IdentifyOptions first = options;
  first.holdout = 0;
  const Identification rough = identify(corrected(), first);
  if (rough.model.rotor && rough.usable()) {
    const RotorModel& m = *rough.model.rotor;
    const double w2 = roll.speed * roll.speed;
    roll.vectors[0] -= m.eps * w2 / Complex(m.k1 - w2, m.c * roll.speed);
  }
  Identification id = identify(corrected(), options);
  state(roll, meaning, id);
  if (id.model.rotor && roll.speed > rules::kSlowRoll * id.model.rotor->natural_frequency()) {
    id.model.summary.warn(
        fmt::format("{}: the slow roll runs at {:.2g} of the critical speed: its vector holds motion "
                    "(stay below 0.3)",
                    slow.source, roll.speed / id.model.rotor->natural_frequency()));
    id.summary = id.model.summary;
  }
  return id;
}

}  // namespace whirl::identification
