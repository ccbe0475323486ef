#include "whirl/control/structure.hpp"

#include <cmath>

namespace whirl::control {
namespace {

/// Free decay of one mode over a time, and where a constant acceleration leads from rest.
struct Transition {
  double f00, f01, f10, f11, q, v;
  Transition(const StructureMode& m, double time) noexcept {
    const double decay = m.damping * m.omega, ringing = m.omega * std::sqrt(1 - m.damping * m.damping);
    const double e = std::exp(-decay * time), c = std::cos(ringing * time), s = std::sin(ringing * time) / ringing;
    f00 = e * (c + decay * s);
    f01 = e * s;
    f10 = -m.omega * m.omega * f01;
    f11 = e * (c - decay * s);
    q = (1 - f00) / (m.omega * m.omega);
    v = f01;
  }
};

}  // namespace

Structure::Structure(const std::array<StructureMode, kModes>& modes, double sample_time, double split) noexcept {
  for (const StructureMode& m : modes) {
    if (!(m.omega > 0) || m.share == 0) continue;
    const Transition whole(m, sample_time), first(m, split * sample_time), second(m, (1 - split) * sample_time);
    Mode& out = modes_[static_cast<std::size_t>(count_++)];
    out.f00 = whole.f00, out.f01 = whole.f01, out.f10 = whole.f10, out.f11 = whole.f11;
    out.first_q = m.share * (second.f00 * first.q + second.f01 * first.v);
    out.first_v = m.share * (second.f10 * first.q + second.f11 * first.v);
    out.second_q = m.share * second.q;
    out.second_v = m.share * second.v;
  }
}

std::complex<double> Structure::step(std::complex<double> first, std::complex<double> second) noexcept {
  std::complex<double> sum;
  for (int i = 0; i < count_; ++i) {
    Mode& m = modes_[static_cast<std::size_t>(i)];
    const std::complex<double> q = m.f00 * m.q + m.f01 * m.v + m.first_q * first + m.second_q * second;
    m.v = m.f10 * m.q + m.f11 * m.v + m.first_v * first + m.second_v * second;
    m.q = q;
    sum += q;
  }
  return sum;
}

void Structure::reset() noexcept {
  for (Mode& m : modes_) m.q = m.v = 0;
}

}  // namespace whirl::control
