#include "output_error/sensitivity_step.hpp"

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
    s.forcing.setZero(rows(forced), states);
  }
}

void SensitivityStep::advance(double h, Eigen::MatrixXd& s) {
  const std::size_t n = row_ends_.size();
  const Eigen::Index rows = s.rows(), forced = stages_[0].forcing.rows();
  Lane* const work = work_.data();
  const Product* const products = products_.data();
  const std::size_t* const row_ends = row_ends_.data();
  double* const all = s.data();
  on_wide_registers([=, this] {
    Lane *start = work, *state = start + n, *rate = state + n, *ends = rate + n, *middle = ends + n;
    // One register of unknowns after the other.
    for (Eigen::Index lane = 0; lane < rows; lane += kRegisterWidth) {
      for (std::size_t i = 0; i < n; ++i) {
        std::memcpy(&start[i].v, all + static_cast<Eigen::Index>(i) * rows + lane, sizeof(Register));
        state[i].v = start[i].v;
      }
      for (std::size_t k = 0; k < 4; ++k) {
        const double *jacobian = stages_[k].jacobian.data(), *forcing = stages_[k].forcing.data() + lane;
        for (std::size_t i = 0, e = 0; i < n; ++i) {
          Register sum{};
          if (lane < forced) std::memcpy(&sum, forcing + static_cast<Eigen::Index>(i) * forced, sizeof sum);
          for (; e < row_ends[i]; ++e) sum += jacobian[products[e].entry] * state[products[e].column].v;
          rate[i].v = sum;
        }
        const double ahead = k < 2 ? 0.5 * h : h;
        for (std::size_t i = 0; i < n; ++i) {
          Lane& kept = k == 0 || k == 3 ? ends[i] : middle[i];
          kept.v = k == 0 || k == 1 ? rate[i].v : kept.v + rate[i].v;
          state[i].v = start[i].v + ahead * rate[i].v;
        }
      }
      for (std::size_t i = 0; i < n; ++i) {
        const Register end = start[i].v + h / 6 * (ends[i].v + 2 * middle[i].v);
        std::memcpy(all + static_cast<Eigen::Index>(i) * rows + lane, &end, sizeof end);
      }
    }
  });
}

}  // namespace whirl::identification::detail
