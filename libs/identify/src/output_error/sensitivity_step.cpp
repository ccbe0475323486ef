#include "output_error/sensitivity_step.hpp"

#include <algorithm>
#include <cstring>

namespace whirl::identification::detail {

SensitivityStep::SensitivityStep(Eigen::Index states, Eigen::Index forced, const std::vector<Entry>& jacobian)
    : work_(5 * static_cast<std::size_t>(states)) {
  for (Eigen::Index i = 0; i < states; ++i) {
    for (std::size_t k = 0; k < jacobian.size(); ++k)
      if (jacobian[k].row == i) products_.push_back({static_cast<std::size_t>(jacobian[k].column), k});
    row_ends_.push_back(products_.size());
  }
  for (Stage& s : stages_) {
    s.jacobian.resize(jacobian.size());
    s.forcing.setZero((forced / kRegisterWidth + 1) * kRegisterWidth, states);
  }
}

void SensitivityStep::advance(double h, Eigen::MatrixXd& s) {
  const std::size_t n = row_ends_.size();
  const Eigen::Index unknowns = s.rows(), forced = stages_[0].forcing.rows();
  Lane *start = work_.data(), *state = start + n, *rate = state + n, *ends = rate + n, *middle = ends + n;
  const double to_next[] = {0.5 * h, 0.5 * h, h};
  // One register of unknowns after the other.
  on_wide_registers([&] {
    for (Eigen::Index lane = 0; lane < unknowns; lane += kRegisterWidth) {
      const auto bytes =
          sizeof(double) * static_cast<std::size_t>(std::min<Eigen::Index>(kRegisterWidth, unknowns - lane));
      for (std::size_t i = 0; i < n; ++i) {
        const double* from = s.data() + static_cast<Eigen::Index>(i) * unknowns + lane;
        Register v{};
        if (bytes == sizeof v)
          std::memcpy(&v, from, sizeof v);
        else
          std::memcpy(&v, from, bytes);
        start[i].v = state[i].v = v;
      }
      for (std::size_t k = 0; k < stages_.size(); ++k) {
        const double *jacobian = stages_[k].jacobian.data(), *forcing = stages_[k].forcing.data() + lane;
        for (std::size_t i = 0, e = 0; i < n; ++i) {
          Register sum{};
          if (lane < forced) std::memcpy(&sum, forcing + static_cast<Eigen::Index>(i) * forced, sizeof sum);
          for (; e < row_ends_[i]; ++e) sum += jacobian[products_[e].entry] * state[products_[e].column].v;
          rate[i].v = sum;
        }
        for (std::size_t i = 0; i < n; ++i) {
          if (k == 0) ends[i].v = rate[i].v;
          if (k == 1) middle[i].v = rate[i].v;
          if (k == 2) middle[i].v += rate[i].v;
          if (k == 3) ends[i].v += rate[i].v;
          if (k < 3) state[i].v = start[i].v + to_next[k] * rate[i].v;
        }
      }
      for (std::size_t i = 0; i < n; ++i) {
        double* to = s.data() + static_cast<Eigen::Index>(i) * unknowns + lane;
        const Register end = start[i].v + h / 6 * (ends[i].v + 2 * middle[i].v);
        if (bytes == sizeof end)
          std::memcpy(to, &end, sizeof end);
        else
          std::memcpy(to, &end, bytes);
      }
    }
  });
}

}  // namespace whirl::identification::detail
