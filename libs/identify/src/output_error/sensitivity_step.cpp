#include "output_error/sensitivity_step.hpp"

#include <cstring>

namespace whirl::identification::detail {

SensitivityStep::SensitivityStep(Eigen::Index states, Eigen::Index forced, const std::vector<Entry>& jacobian)
    : work_(5 * kTogether * static_cast<std::size_t>(states)) {
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

/// `Registers` of unknowns beside each other, from `lane` on: their sums do not wait for one another.
template <int Registers>
[[gnu::always_inline]] inline void SensitivityStep::advance_lanes(double h, Eigen::Index lane, Eigen::Index rows,
                                                                  double* all) {
  const std::size_t n = row_ends_.size();
  const Eigen::Index forced = stages_[0].forcing.rows();
  Lane *start = work_.data(), *state = start + kTogether * n, *rate = state + kTogether * n;
  Lane *ends = rate + kTogether * n, *middle = ends + kTogether * n;
  const Product* const products = products_.data();
  const std::size_t* const row_ends = row_ends_.data();
  for (std::size_t i = 0; i < n; ++i) {
    for (int r = 0; r < Registers; ++r) {
      const std::size_t at = Registers * i + r;
      std::memcpy(&start[at].v, all + static_cast<Eigen::Index>(i) * rows + lane + r * kRegisterWidth,
                  sizeof(Register));
      state[at].v = start[at].v;
    }
  }
  for (std::size_t k = 0; k < 4; ++k) {
    const double *jacobian = stages_[k].jacobian.data(), *forcing = stages_[k].forcing.data() + lane;
    for (std::size_t i = 0, e = 0; i < n; ++i) {
      Register sum[Registers] = {};
      for (int r = 0; r < Registers; ++r)
        if (lane + r * kRegisterWidth < forced)
          std::memcpy(&sum[r], forcing + static_cast<Eigen::Index>(i) * forced + r * kRegisterWidth, sizeof sum[r]);
      for (; e < row_ends[i]; ++e) {
        const double factor = jacobian[products[e].entry];
        const Lane* const of = state + Registers * products[e].column;
        for (int r = 0; r < Registers; ++r) sum[r] += factor * of[r].v;
      }
      for (int r = 0; r < Registers; ++r) rate[Registers * i + r].v = sum[r];
    }
    const double ahead = k < 2 ? 0.5 * h : h;
    Lane* const kept = k == 0 || k == 3 ? ends : middle;
    const bool begins = k < 2;
    for (std::size_t i = 0; i < Registers * n; ++i) {
      kept[i].v = begins ? rate[i].v : kept[i].v + rate[i].v;
      state[i].v = start[i].v + ahead * rate[i].v;
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (int r = 0; r < Registers; ++r) {
      const std::size_t at = Registers * i + r;
      const Register end = start[at].v + h / 6 * (ends[at].v + 2 * middle[at].v);
      std::memcpy(all + static_cast<Eigen::Index>(i) * rows + lane + r * kRegisterWidth, &end, sizeof end);
    }
  }
}

void SensitivityStep::advance(double h, Eigen::MatrixXd& s) {
  const Eigen::Index rows = s.rows();
  double* const all = s.data();
  on_wide_registers([=, this] {
    Eigen::Index lane = 0;
    for (; lane + kTogether * kRegisterWidth <= rows; lane += kTogether * kRegisterWidth)
      advance_lanes<kTogether>(h, lane, rows, all);
    for (; lane < rows; lane += kRegisterWidth) advance_lanes<1>(h, lane, rows, all);
  });
}

}  // namespace whirl::identification::detail
