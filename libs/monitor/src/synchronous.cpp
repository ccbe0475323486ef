#include "whirl/monitor/synchronous.hpp"

#include <cmath>

#include "whirl/core/angles.hpp"

namespace whirl::monitor {

using Eigen::Index;

namespace {}

void SynchronousTracker::reset() {
  sum_.setZero();
  turned_ = samples_ = 0;
  valid_ = false;
}

std::vector<SynchronousTracker::Revolution> SynchronousTracker::push(
    const Eigen::Ref<const Eigen::VectorXd>& beta, const Eigen::Ref<const Eigen::MatrixXd>& displacement) {
  std::vector<Revolution> out;
  const auto at = [](double angle) { return std::polar(1.0, -angle); };
  for (Index i = 0; i < beta.size(); ++i) {
    const Eigen::VectorXd x = displacement.row(i).transpose();
    if (!std::isfinite(beta(i)) || !x.allFinite()) {
      reset();
      continue;
    }
    if (!valid_) {
      reset();
      valid_ = true;
      last_ = x;
      last_beta_ = beta(i);
      continue;
    }
    // A wrapped angle continues; beyond half a turn per sample it cannot be followed.
    double step = beta(i) - last_beta_;
    step -= kTwoPi * std::round(step / kTwoPi);
    double from = 0;  // part of the step already used
    while (from < 1) {
      const double left = kTwoPi - std::abs(turned_);
      const double rest = std::abs(step) * (1 - from);
      const double to = rest >= left && step != 0 ? from + left / std::abs(step) : 1;
      const Eigen::VectorXd x_from = last_ + from * (x - last_), x_to = last_ + to * (x - last_);
      const double b_from = last_beta_ + from * step, b_to = last_beta_ + to * step;
      const std::complex<double> e_from = at(b_from), e_to = at(b_to);
      for (Index c = 0; c < sum_.size(); ++c) {
        sum_(c) += 0.5 * (x_from(c) * e_from + x_to(c) * e_to) * (b_to - b_from);
      }
      turned_ += b_to - b_from;
      samples_ += to - from;
      if (to < 1 || std::abs(turned_) >= kTwoPi * (1 - 1e-12)) {
        if (samples_ > 0)
          out.push_back({turned_ / samples_ * rate_, (static_cast<double>(i - 1) + to) / rate_,
                         Eigen::VectorXcd(sum_ * (2 / turned_))});
        sum_.setZero();
        turned_ = samples_ = 0;
      }
      if (to <= from) break;  // cannot progress: the next sample goes on
      from = to;
    }
    last_ = x;
    last_beta_ = beta(i);
  }
  return out;
}

}  // namespace whirl::monitor
