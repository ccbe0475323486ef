#include <numbers>

#include "whirl/control/laws/pd_synchronous.hpp"

namespace whirl::control {

SynchronousCanceller::SynchronousCanceller(Method method, double rate, double kp, double kd, const LateralModel& model,
                                           double delay, double sample_time, double omega_min) noexcept
    : method_(method),
      rate_(rate),
      kp_(kp),
      kd_(kd),
      k1_(model.k1),
      c_(model.c),
      delay_(delay),
      h_(sample_time),
      omega_min_(omega_min) {}

void SynchronousCanceller::reset() noexcept {
  q_ = sum_ = {};
  count_ = 0;
}

std::complex<double> SynchronousCanceller::response(double omega) const noexcept {
  const std::complex<double> feedback = product({kp_, omega * kd_}, unit_phasor(-omega * delay_));
  return omega * omega / (std::complex<double>(k1_ - omega * omega, omega * c_) + feedback);
}

std::complex<double> SynchronousCanceller::step(std::complex<double> z, double beta, double omega,
                                                std::complex<double> forcing, bool adapt) noexcept {
  if (adapt && std::abs(omega) >= omega_min_) {
    const std::complex<double> g = response(omega), phasor = product(z, unit_phasor(-beta));
    switch (method_) {
      case Method::influence:
        if (count_ == 0) turn_start_ = beta;
        sum_ += phasor;
        ++count_;
        if (std::abs(beta - turn_start_) >= 2 * std::numbers::pi) {
          q_ -= rate_ * (sum_ / static_cast<double>(count_)) / g;
          sum_ = {};
          count_ = 0;
        }
        break;
      case Method::fxlms:
        q_ -= h_ * rate_ * product(std::conj(g), phasor);
        break;
      case Method::notch:
        q_ -= h_ * rate_ * product(std::conj(g) / std::abs(g), phasor);
        break;
    }
  } else {
    sum_ = {};  // a turn with lost samples is no average
    count_ = 0;
  }
  return product(q_, forcing);
}

}  // namespace whirl::control
