#include <gtest/gtest.h>

#include <map>
#include <random>

#include "output_error/rotor/output_error_kernel.hpp"
#include "rotor_synthetic.hpp"
#include "whirl/expr/expr.hpp"
#include "whirl/identify/output_error_rotor.hpp"
#include "whirl/identify/weak_rotor.hpp"
#include "whirl/rotor/modal_response.hpp"

namespace whirl::identification {
namespace {

using namespace testing;

Eigen::VectorXcd half_forcing(const AngleSignal& a) {
  Eigen::VectorXcd f(a.beta.size());
  for (Eigen::Index i = 0; i < f.size(); ++i) {
    f[i] = std::polar(1.0, a.beta[i]) * Complex(a.omega[i] * a.omega[i], -a.alpha[i]);
  }
  return f;
}

/// A term of each part of every force, of a size that matters on rotor_a; sizes by parameter.
std::vector<RotorTerm> every_force() {
  const std::map<std::string_view, double> sizes{{"k3", 1e16},
                                                 {"k2_axis", 1e8},
                                                 {"c2", 5},
                                                 {"friction", 0.01},
                                                 {"gyroscopic", 0.02},
                                                 {"c_rotating", 0.5},
                                                 {"k_cross", 50},
                                                 {"k1_speed", 1},
                                                 {"c_speed", 0.01},
                                                 {"k1_drift", 20},
                                                 {"c_drift", 0.5},
                                                 {"e2_forward_re", 1e-4},
                                                 {"e2_forward_im", 5e-5},
                                                 {"e2_backward_re", 3e-5},
                                                 {"e2_backward_im", 2e-5},
                                                 {"k_radius", 1e6},
                                                 {"k_hertz", 1e4},
                                                 {"kq_x", 1e6},
                                                 {"kq_y", -6e5},
                                                 {"kq_xxy", 4e5},
                                                 {"kq_xyy", -8e5},
                                                 {"c_film", 1e6},
                                                 {"k1_loss", 100},
                                                 {"c_cross", 0.3},
                                                 {"k1_turning_re", 60},
                                                 {"k1_turning_im", -40},
                                                 {"sag_turning_re", 0.1},
                                                 {"sag_turning_im", -0.05},
                                                 {"k1_step", -100},
                                                 {"eps_step_re", 3e-5},
                                                 {"eps_step_im", -2e-5},
                                                 {"bow_growth_re", 0.02},
                                                 {"bow_growth_im", -0.03}};
  std::vector<RotorTerm> terms;
  for (const TermEntry* entry : term_catalogue()) {
    for (std::size_t part = 0; entry->force != nullptr && part < entry->parameters.size(); ++part) {
      const std::string_view name = entry->parameters[part].name;
      EXPECT_TRUE(sizes.contains(name)) << "a size for " << name;
      if (!sizes.contains(name)) continue;
      double reference = entry->drifts ? 0.7 : 0;
      if (!entry->drifts && entry->reference != nullptr) reference = entry->reference(1e-3, 75, 0);
      terms.push_back({entry, part, sizes.at(name), reference});
    }
  }
  return terms;
}

class OutputErrorKernelProperty : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Derivative, OutputErrorKernelProperty, ::testing::Range(0, 3));

// Each force beyond the plain rotor, beside others, in displacement, velocity and acceleration: the derivatives by its
// coefficient and by its reference against differences.
TEST_P(OutputErrorKernelProperty, SensitivitiesOfForcesBeyondTheRotorAreTheDerivatives) {
  const detail::StepGrid grid{1e-3, 1, GetParam()};
  const RotorModel m = rotor_a();
  const Sweep sweep{20, 5, 2, 0.3, 1e-3};
  const AngleSignal angle = sweep.angle();
  const Eigen::VectorXcd f = half_forcing(angle);
  const Complex z0(2e-4, -1e-4), v0(0.01, 0.02);
  const std::vector<RotorTerm> all = every_force();
  constexpr std::size_t kTogether = 9;  // as a fit may have
  for (std::size_t first = 0; first < all.size(); first += kTogether) {
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
    const std::vector<RotorTerm> terms(begin,
                                       begin + static_cast<std::ptrdiff_t>(std::min(kTogether, all.size() - first)));
    const detail::Sensitivities s =
        detail::main_mode_sensitivities(m, m.eps, f, Eigen::MatrixXcd(f.size(), 0), {terms, angle, 0.2}, grid, z0, v0);
    ASSERT_TRUE(s.finite);
    const auto check = [&](Eigen::Index lane, double step, auto&& move, std::string_view name) {
      const auto run = [&](double by) {
        std::vector<RotorTerm> moved = terms;
        for (RotorTerm& t : moved) move(t, by);
        return detail::main_mode(m, m.eps, f, {moved, angle, 0.2}, grid, z0, v0).read(GetParam());
      };
      const Eigen::VectorXcd d = (run(step) - run(-step)) / (2 * step);
      Eigen::VectorXcd found(d.size());
      found.real() = s.dx.col(detail::kProfile + lane);
      found.imag() = s.dy.col(detail::kProfile + lane);
      EXPECT_GT(d.norm(), 0) << name;
      EXPECT_LT((found - d).norm(), 1e-4 * d.norm()) << name;
    };
    const std::vector<Eigen::Index> references = detail::reference_lanes(terms);
    for (std::size_t k = 0; k < terms.size(); ++k) {
      const RotorTerm& own = terms[k];
      check(
          static_cast<Eigen::Index>(k), 1e-3 * own.value,
          [&](RotorTerm& t, double by) { t.value += t.entry == own.entry && t.part == own.part ? by : 0; },
          own.parameter());
      if (references[k] < 0 || own.part > 0) continue;
      check(
          static_cast<Eigen::Index>(terms.size()) + references[k], 1e-5,
          [&](RotorTerm& t, double by) { t.reference += t.entry == own.entry ? by : 0; }, own.entry->reference_name);
    }
  }
}

// What a term adds to the equations is its force, at any state. Of a change at one instant: before and after it.
TEST(RotorTermCatalogueProperty, TheTextOfATermIsItsForce) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  for (const RotorTerm& term : every_force()) {
    for (int draw = 0; draw < 20; ++draw) {
      TermPoint p{1e-3 * normal(random), 1e-3 * normal(random), 0.1 * normal(random), 0.1 * normal(random)};
      p.w = 80 + 30 * normal(random), p.beta = 3 * normal(random), p.time = 3 * normal(random),
      p.alpha = 20 * normal(random);
      if (std::abs(p.time - term.reference) < 0.05) continue;
      const TermForce force = term_force(term, p);
      const std::map<std::string, double, std::less<>> at{{"X1", p.x},    {"X2", p.vx}, {"X3", p.y},     {"X4", p.vy},
                                                          {"X5", p.beta}, {"X6", p.w},  {"X7", p.alpha}, {"t", p.time}};
      for (const bool x : {true, false}) {
        double sum = 0;
        for (const auto& [function, sign] : term_text(term, x))
          sum += sign * expr::evaluate(expr::Expr::parse(function), at);
        EXPECT_NEAR(sum, x ? force.x : force.y, 1e-9 * std::hypot(force.x, force.y)) << term.parameter();
      }
    }
  }
}

// The derivatives of every force by the state against differences.
TEST(RotorTermCatalogueProperty, TheDerivativesOfAForceAreThose) {
  std::mt19937_64 random(12);
  std::normal_distribution<double> normal;
  for (const RotorTerm& term : every_force()) {
    TermPoint p{
        1e-3 * normal(random), 1e-3 * normal(random), 0.1 * normal(random), 0.1 * normal(random), 90, 1.3, 0.5, 5};
    const TermForce f = term_force(term, p);
    const auto slope = [&](double TermPoint::*state, double step) {
      TermPoint more = p, less = p;
      more.*state += step, less.*state -= step;
      const TermForce a = term_force(term, more), b = term_force(term, less);
      return Complex((a.x - b.x) / (2 * step), (a.y - b.y) / (2 * step));
    };
    const double scale = std::abs(f.x) + std::abs(f.y);
    EXPECT_LT(std::abs(slope(&TermPoint::x, 1e-8) - Complex(f.x_x, f.y_x)), 1e-4 * scale / 1e-3) << term.parameter();
    EXPECT_LT(std::abs(slope(&TermPoint::y, 1e-8) - Complex(f.x_y, f.y_y)), 1e-4 * scale / 1e-3) << term.parameter();
    EXPECT_LT(std::abs(slope(&TermPoint::vx, 1e-6) - Complex(f.x_vx, f.y_vx)), 1e-4 * scale / 0.1) << term.parameter();
    EXPECT_LT(std::abs(slope(&TermPoint::vy, 1e-6) - Complex(f.x_vy, f.y_vy)), 1e-4 * scale / 0.1) << term.parameter();
  }
}

TEST_P(OutputErrorKernelProperty, SensitivitiesAreTheDerivatives) {
  const detail::StepGrid grid{1e-3, 1, GetParam()};
  RotorModel m = rotor_a();
  m.k1_conj = {30, -20};
  m.c_conj = {0.1, 0.2};
  const Sweep sweep{20, 5, 2, 0.3, 1e-3};
  const Eigen::VectorXcd f = half_forcing(sweep.angle());
  const Complex z0(2e-4, -1e-4), v0(0.01, 0.02);
  const AngleSignal angle = sweep.angle();
  const std::vector<RotorTerm> none;
  const detail::TermForces plain{none, angle, 0};
  const detail::Sensitivities s =
      detail::main_mode_sensitivities(m, m.eps, f, Eigen::MatrixXcd(f.size(), 0), plain, grid, z0, v0);
  const auto check = [&](int lane, auto&& changed, double step) {
    const Eigen::VectorXcd d = (changed(step) - changed(-step)) / (2 * step);
    Eigen::VectorXcd found(d.size());
    found.real() = s.dx.col(lane);
    found.imag() = s.dy.col(lane);
    EXPECT_LT((found - d).norm(), 1e-5 * d.norm()) << "lane " << lane;
  };
  const auto run = [&](const RotorModel& model, Complex a = 0, Complex b = 0) {
    return detail::main_mode(model, model.eps, f, plain, grid, z0 + a, v0 + b).read(GetParam());
  };
  const auto with = [&](auto&& edit) {
    return [&, edit](double d) {
      RotorModel changed = m;
      edit(changed, d);
      return run(changed);
    };
  };
  check(detail::kK1, with([](RotorModel& r, double d) { r.k1 += d; }), 1e-2);
  check(detail::kK2, with([](RotorModel& r, double d) { r.k2 += d; }), 1e3);
  check(detail::kC, with([](RotorModel& r, double d) { r.c += d; }), 1e-4);
  check(detail::kEpsRe, with([](RotorModel& r, double d) { r.eps += d; }), 1e-9);
  check(detail::kEpsIm, with([](RotorModel& r, double d) { r.eps += Complex(0, d); }), 1e-9);
  check(detail::kConjKRe, with([](RotorModel& r, double d) { r.k1_conj += d; }), 1e-2);
  check(detail::kConjKIm, with([](RotorModel& r, double d) { r.k1_conj += Complex(0, d); }), 1e-2);
  check(detail::kConjCRe, with([](RotorModel& r, double d) { r.c_conj += d; }), 1e-4);
  check(detail::kConjCIm, with([](RotorModel& r, double d) { r.c_conj += Complex(0, d); }), 1e-4);
  check(
      detail::kX0, [&](double d) { return run(m, d); }, 1e-8);
  // The derivative of F by a quadratic change of the angle.
  const double horizon = 0.5 * angle.dt * static_cast<double>(angle.beta.size() - 1);
  const auto turned = [&](double d) {
    AngleSignal a = angle;
    for (Eigen::Index i = 0; i < a.beta.size(); ++i) {
      const double u = static_cast<double>(i) / static_cast<double>(a.beta.size() - 1);
      a.beta[i] += d * u * u;
      a.omega[i] += d * 2 * u / horizon;
      a.alpha[i] += d * 2 / (horizon * horizon);
    }
    return half_forcing(a);
  };
  const Eigen::MatrixXcd slope = (turned(1e-4) - turned(-1e-4)) / 2e-4;
  const detail::Sensitivities p = detail::main_mode_sensitivities(m, m.eps, f, slope, plain, grid, z0, v0);
  const auto read = [&](double d) {
    return detail::main_mode(m, m.eps, turned(d), plain, grid, z0, v0).read(GetParam());
  };
  const Eigen::VectorXcd by_angle = (read(1e-4) - read(-1e-4)) / 2e-4;
  Eigen::VectorXcd found(by_angle.size());
  found.real() = p.dx.col(detail::kProfile);
  found.imag() = p.dy.col(detail::kProfile);
  EXPECT_LT((found - by_angle).norm(), 1e-5 * by_angle.norm());
  check(
      detail::kVy0, [&](double d) { return run(m, 0, Complex(0, d)); }, 1e-6);
}

TEST(OutputErrorKernelReference, StiffForcedModeFollowsItsSteadyState) {
  // 310 Hz sampled at 1 kHz: w dt = 1.95, beyond any classical step; constant speed, so the answer is the steady state.
  const Sweep sweep{30, 30, 1, 0, 1e-3};
  const double w = kTurn * 310, zeta = 0.01, w0 = sweep.omega0();
  for (const int derivative : {0, 1, 2}) {
    const Eigen::VectorXcd q = rotor::modal_response(w, zeta, half_forcing(sweep.angle()), 1e-3, w0, derivative);
    for (Eigen::Index i = 0; i < q.size(); i += 97) {
      const Complex steady = std::pow(Complex(0, w0), derivative) *
                             std::polar(w0 * w0, w0 * 1e-3 * static_cast<double>(i)) /
                             Complex(w * w - w0 * w0, 2 * zeta * w * w0);
      // An interpolated F misses F by so much; each derivative weighs what the mode answers by w against w0.
      EXPECT_LT(std::abs(q[i] - steady), 1e-4 * std::pow(w / w0, derivative) * std::abs(steady)) << derivative;
    }
  }
}

TEST(OutputErrorReference, RotorAAtTwentyDecibels) {
  const RotorModel truth = rotor_a();
  const Eigen::VectorXcd clean = motion(truth, {});
  ModelError rms{};
  const int seeds = 4;
  for (unsigned seed = 1; seed <= seeds; ++seed) {
    const std::vector<RotorRecord> records = {record(with_noise(clean, 20, seed), {})};
    const WeakRotorFit weak = fit_weak_rotor(records);
    const OutputErrorFit fit = fit_output_error_rotor(records, weak.model);
    ASSERT_EQ(fit.summary.status, Status::ok) << fit.summary.warnings[0];
    EXPECT_NEAR(fit.summary.chi_square, 1, 0.06);
    const ModelError e = model_error(fit.model, truth);
    rms.k1 += e.k1 * e.k1 / seeds;
    rms.k2 += e.k2 * e.k2 / seeds;
    rms.c += e.c * e.c / seeds;
    rms.e += e.e * e.e / seeds;
    rms.phase += e.phase * e.phase / seeds;
    EXPECT_LT(std::sqrt((fit.records[0].main + fit.records[0].beside - clean).squaredNorm() / 24000), 1e-6);
    EXPECT_LT(fit.iterations, 7);
  }
  EXPECT_LT(std::sqrt(rms.k1), 0.03);
  EXPECT_LT(std::sqrt(rms.k2), 1.3);
  EXPECT_LT(std::sqrt(rms.c), 0.15);
  EXPECT_LT(std::sqrt(rms.e), 0.16);
  EXPECT_LT(std::sqrt(rms.phase), 0.08);
}

TEST(OutputErrorReference, ConvergesFromAFarStart) {
  const RotorModel truth = rotor_a();
  const std::vector<RotorRecord> records = {record(with_noise(motion(truth, {}), 20, 9), {})};
  for (const double sign : {-1.0, 1.0}) {
    RotorModel start = truth;
    start.k1 *= 1 + 0.08 * sign;
    start.k2 *= 1 - 0.9 * sign;
    start.c *= 1 + 0.5 * sign;
    start.eps *= 1 - 0.4 * sign;
    const OutputErrorFit fit = fit_output_error_rotor(records, start);
    EXPECT_EQ(fit.summary.status, Status::ok);
    EXPECT_NEAR(fit.model.k1 / truth.k1, 1, 1e-3);
    EXPECT_NEAR(fit.summary.chi_square, 1, 0.06);
  }
}

}  // namespace
}  // namespace whirl::identification
