#include "whirl/rotor/modal_response.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace whirl::rotor {
namespace {

TEST(ModalResponse, SeveralPolesAtOnceGiveWhatEachGivesAlone) {
  const double dt = 1e-3, omega0 = 60;
  Eigen::VectorXcd forcing(2001);  // a speed that falls
  for (Eigen::Index i = 0; i < forcing.size(); ++i) {
    const double t = 0.5 * dt * static_cast<double>(i), w = omega0 - 20 * t;
    forcing[i] = std::polar(w * w, omega0 * t - 10 * t * t);
  }
  const std::vector<Pole> poles{{50, 0.02}, {50.0005, 0.02}, {49.9995, 0.02}, {300, 0.1}, {4000, 0.01}};
  for (const int derivative : {0, 1, 2}) {
    for (const Eigen::Index every : {1, 4}) {
      const auto all = modal_responses(poles, forcing, dt, omega0, derivative, every);
      ASSERT_EQ(all.size(), poles.size());
      for (std::size_t k = 0; k < poles.size(); ++k) {
        const Eigen::VectorXcd alone = modal_response(poles[k].w, poles[k].zeta, forcing, dt, omega0, derivative);
        const Eigen::VectorXcd kept = alone(Eigen::seq(Eigen::Index{0}, alone.size() - 1, every));
        ASSERT_EQ(all[k].size(), kept.size());
        EXPECT_LT((all[k] - kept).norm(), 1e-11 * kept.norm()) << k << " " << derivative << " " << every;
      }
    }
  }
}

}  // namespace
}  // namespace whirl::rotor
