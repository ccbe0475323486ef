// Speed of the compiled tape: samples x terms per second for paper eq. 24 (17 terms) and with 35 damped pole pairs (87
// terms), beside a loop written by hand for the same columns and beside memcpy of the columns written.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <complex>
#include <cstring>
#include <functional>
#include <random>

#include "whirl/expr/library.hpp"
#include "whirl/expr/tape.hpp"

namespace {
using namespace whirl;
const std::vector<std::string> kNames{"X1", "X2", "X3", "X4", "X5", "X6", "t"};

/// Seconds of one call: best of 15 after a warm-up.
double seconds(const std::function<void()>& run) {
  run();
  double best = 1e300;
  for (int i = 0; i < 15; ++i) {
    const auto start = std::chrono::steady_clock::now();
    run();
    best = std::min(best, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  return best;
}

void by_hand_17(const Eigen::MatrixXd& v, Eigen::MatrixXd& out) {
  for (Eigen::Index i = 0; i < v.rows(); ++i) {
    const double x = v(i, 0), dx = v(i, 1), y = v(i, 2), dy = v(i, 3), w = v(i, 5), s = std::sin(v(i, 4)),
                 c = std::cos(v(i, 4));
    const double w2 = w * w, x2 = x * x, y2 = y * y;
    out(i, 0) = 1;
    out(i, 1) = x;
    out(i, 2) = x * x2;
    out(i, 3) = dx;
    out(i, 4) = w2 * c;
    out(i, 5) = w2 * s;
    out(i, 6) = w * c;
    out(i, 7) = w * s;
    out(i, 8) = y;
    out(i, 9) = y * y2;
    out(i, 10) = dy;
    out(i, 11) = x * y2;
    out(i, 12) = x2 * y;
    out(i, 13) = w;
    out(i, 14) = w2;
    out(i, 15) = s;
    out(i, 16) = c;
  }
}

void by_hand_87(const Eigen::MatrixXd& v, const std::vector<std::complex<double>>& poles, Eigen::MatrixXd& out) {
  by_hand_17(v, out);
  for (std::size_t p = 0; p < poles.size(); ++p) {
    const auto column = static_cast<Eigen::Index>(17 + 2 * p);
    for (Eigen::Index i = 0; i < v.rows(); ++i) {
      const double t = v(i, 6), decay = std::exp(poles[p].real() * t), angle = poles[p].imag() * t;
      out(i, column) = decay * std::cos(angle);
      out(i, column + 1) = decay * std::sin(angle);
    }
  }
}

void report(const char* name, Eigen::Index samples, Eigen::Index terms, double tape, double hand, double copy) {
  fmt::print("{:8} {:9} {:6} {:12.0f} {:10.2f} {:12.0f} {:14.2f} {:14.3f}\n", name, samples, terms,
             static_cast<double>(samples * terms) / tape * 1e-6, tape / static_cast<double>(samples) * 1e9,
             static_cast<double>(samples * terms) * 8 / copy * 1e-9, hand / tape, copy / tape);
}

}  // namespace

int main() {
  std::vector<std::complex<double>> poles;
  for (int k = 0; k < 35; ++k) poles.emplace_back(-0.05 - 0.01 * k, 20.0 + 11 * k);
  const std::vector<expr::Expr> eq24 = expr::rotor_library();
  const std::vector<expr::Expr> full = expr::union_library({eq24, expr::modal_library(poles)});
  const expr::Tape tape17 = expr::compile(eq24, kNames), tape87 = expr::compile(full, kNames);
  fmt::print("{:8} {:>9} {:>6} {:>12} {:>10} {:>12} {:>14} {:>14}\n", "library", "samples", "terms", "M terms/s",
             "ns/sample", "memcpy GB/s", "hand/tape", "memcpy/tape");
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> number(-1, 1);
  for (const Eigen::Index samples : {15000, 150000}) {
    Eigen::MatrixXd v(samples, 7);
    for (double& x : v.reshaped()) x = number(random);
    v.col(4) *= 300;
    v.col(6) = Eigen::VectorXd::LinSpaced(samples, 0, 15);
    for (const Eigen::Index terms : {17, 87}) {
      Eigen::MatrixXd out(samples, terms), same(samples, terms), copy(samples, terms);
      const expr::Tape& tape = terms == 17 ? tape17 : tape87;
      const double t = seconds([&] { tape.evaluate(v, out); });
      const double h = seconds([&] { terms == 17 ? by_hand_17(v, same) : by_hand_87(v, poles, same); });
      const double c =
          seconds([&] { std::memcpy(copy.data(), out.data(), static_cast<std::size_t>(out.size()) * sizeof(double)); });
      const double worst = ((out - same).cwiseAbs().array() / (1e-300 + same.cwiseAbs().array().maxCoeff())).maxCoeff();
      report(terms == 17 ? "eq. 24" : "+ modes", samples, terms, t, h, c);
      if (worst > 1e-12 || copy(samples - 1, 0) != out(samples - 1, 0)) {
        fmt::print("tape and loop disagree by {:.3g}\n", worst);
        return 1;
      }
    }
  }
}
