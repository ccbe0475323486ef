#include "whirl/diagnosis/modal_influence.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "whirl/core/error.hpp"

namespace whirl::diagnosis {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;

/// "disk:-X": point, axis and sign; without a colon the whole is the point.
struct Place {
  std::string point;
  char axis = ' ';
  double sign = 1;
};

Place place_of(const std::string& name) {
  const std::size_t colon = name.rfind(':');
  if (colon == std::string::npos || colon + 1 >= name.size()) return {name};
  return {name.substr(0, colon), name.back(), name[colon + 1] == '-' ? -1.0 : 1.0};
}

/// Residues of every mode between points, the directions counted off.
class Residues {
 public:
  explicit Residues(const ModalModel& modes) : modes_(modes) {
    for (std::size_t c = 0; c < modes.responses.size(); ++c) {
      const Place to = place_of(modes.responses[c]), from = place_of(modes.references[c]);
      if (to.axis == from.axis) channels_.push_back({to.point, from.point, static_cast<Index>(c), to.sign * from.sign});
    }
  }

  /// By mode; nothing where no channels connect the points.
  std::optional<Eigen::VectorXcd> between(const std::string& a, const std::string& b) const {
    if (auto direct = of(a, b)) return direct;
    for (const Channel& c : channels_) {
      if (c.to != c.from) continue;
      const auto at_a = of(a, c.to), at_b = of(b, c.to), own = of(c.to, c.to);
      if (!at_a || !at_b || !own || (own->array() == 0.0).any()) continue;
      return Eigen::VectorXcd(at_a->array() * at_b->array() / own->array());
    }
    return {};
  }

  /// Points of all channels, for messages.
  std::string points() const {
    std::string text;
    std::vector<std::string> named;
    for (const Channel& c : channels_)
      for (const std::string& point : {c.to, c.from}) {
        if (std::ranges::find(named, point) != named.end()) continue;
        named.push_back(point);
        text += (text.empty() ? "" : ", ") + point;
      }
    return text.empty() ? "none" : text;
  }

 private:
  struct Channel {
    std::string to, from;
    Index channel;
    double sign;
  };
  std::optional<Eigen::VectorXcd> of(const std::string& a, const std::string& b) const {
    for (const Channel& c : channels_) {
      if (!((c.to == a && c.from == b) || (c.to == b && c.from == a))) continue;
      Eigen::VectorXcd r(static_cast<Index>(modes_.modes.size()));
      for (Index k = 0; k < r.size(); ++k)
        r[k] = c.sign * modes_.modes[static_cast<std::size_t>(k)].residues[c.channel];
      return r;
    }
    return {};
  }

  const ModalModel& modes_;
  std::vector<Channel> channels_;
};

void check(const ModalModel& modes, const ModalReadings& r) {
  if (!(r.radius > 0)) throw Error::in_field("radius", fmt::format("{:g} m", r.radius), "positive");
  if (modes.modes.empty()) throw Error("influence from modes: the file has no mode");
  if (r.probes.size() != r.speed.size() || r.probes.size() != r.angle.size())
    throw Error(fmt::format("influence from modes: {} probes, {} speeds and {} angles", r.probes.size(), r.speed.size(),
                            r.angle.size()));
  for (const double w : r.speed)
    if (!(w > 0)) throw Error::in_field("speed", fmt::format("{:g} rad/s", w), "positive");
}

}  // namespace

Eigen::MatrixXcd modal_influence(const ModalModel& modes, const ModalReadings& r) {
  check(modes, r);
  const Residues residues(modes);
  Eigen::MatrixXcd out(static_cast<Index>(r.probes.size()), static_cast<Index>(r.planes.size()));
  for (std::size_t p = 0; p < r.planes.size(); ++p) {
    for (std::size_t m = 0; m < r.probes.size(); ++m) {
      const std::string plane = place_of(r.planes[p]).point, probe = place_of(r.probes[m]).point;
      const auto a = residues.between(probe, plane);
      if (!a)
        throw Error(fmt::format(
            "the modes do not connect plane '{}' with probe '{}': planes and probes of the job are named as the points "
            "of the modes ({}); a channel between them, or both with one point where the impact's own motion was "
            "measured",
            r.planes[p], r.probes[m], residues.points()));
      const double w = r.speed[m];
      Complex receptance = 0;
      for (Index k = 0; k < a->size(); ++k) {
        const Complex pole = modes.modes[static_cast<std::size_t>(k)].pole, s(0, w);
        receptance += (*a)[k] / (s - pole) + std::conj((*a)[k]) / (s - std::conj(pole));
      }
      out(static_cast<Index>(m), static_cast<Index>(p)) =
          r.radius * w * w * receptance * std::polar(1.0, r.mark - r.angle[m]);
    }
  }
  return out;
}

InfluencePrior modal_prior(const ModalModel& modes, const ModalReadings& r, double common, double each, int draws,
                           unsigned seed) {
  const Eigen::MatrixXcd mean = modal_influence(modes, r);
  std::vector<int> speed(r.speed.size());
  for (std::size_t m = 0; m < speed.size(); ++m)
    speed[m] = static_cast<int>(std::ranges::find(r.speed, r.speed[m]) - r.speed.begin());
  InfluencePrior prior = relative_prior(mean, common, each, speed);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Eigen::MatrixXcd spread = Eigen::MatrixXcd::Zero(mean.size(), mean.size());
  for (int d = 0; d < draws; ++d) {
    ModalModel drawn = modes;
    for (Mode& mode : drawn.modes) {
      const double own = std::abs(mode.pole), first = normal(random), second = normal(random);
      const double sd_f = std::isfinite(mode.frequency.sd) ? 2 * std::numbers::pi * mode.frequency.sd : 0;
      const double sd_zeta = std::isfinite(mode.damping.sd) ? mode.damping.sd : 0;
      const double w = std::max(0.01 * own, own + sd_f * first);
      const double zeta = std::clamp(-mode.pole.real() / own + sd_zeta * second, 1e-6, 0.99);
      mode.pole = {-zeta * w, w * std::sqrt(1 - zeta * zeta)};
    }
    const Eigen::VectorXcd apart = (modal_influence(drawn, r) - mean).reshaped();
    spread += apart * apart.adjoint() / draws;
  }
  prior.covariance += spread;
  return prior;
}

}  // namespace whirl::diagnosis
