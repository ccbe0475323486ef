// The paper's chain against the simple consistent mode on a synthetic rotor, 20 dB: coefficients and free-run error.
#include <fmt/format.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "whirl/identify/compare.hpp"
#include "whirl/identify/paper.hpp"
#include "whirl/rotor/simulate.hpp"

using namespace whirl;

int main() {
  const double pi = std::numbers::pi, w = 2 * pi * 12;
  RotorModel truth;
  truth.k1 = w * w;
  truth.k2 = 0.25 * truth.k1 / std::pow(3e-3, 2);
  truth.c = 2 * 0.02 * w;
  truth.eps = std::polar(0.08e-3, 0.7);
  const AngleSignal angle = rotor::angle_signal(rotor::SpeedProfile::run_down(2 * pi * 30, 12.0), 1e-3);
  const auto record_of = [&](double snr_db, int seed) {
    Recording r = rotor::simulate(truth, angle).recording();
    std::mt19937_64 engine(static_cast<std::uint64_t>(seed));
    std::normal_distribution<double> normal;
    for (Channel& c : r.channels) {
      const double sd =
          std::sqrt((c.samples.array() - c.samples.mean()).square().mean()) * std::pow(10.0, -snr_db / 20);
      for (double& v : c.samples) v += sd * normal(engine);
    }
    Eigen::VectorXd beta(r.size());
    for (Eigen::Index i = 0; i < r.size(); ++i) beta[i] = angle.beta[2 * i];
    r.add("beta", Quantity::angle, beta);
    return r;
  };
  const auto print = [&](const char* name, double snr, int seed, const IdentifiedModel& m) {
    const auto error = [&](const char* p, double t) {
      const Estimate* e = m.parameter(p);
      return e == nullptr ? std::nan("") : 100 * (e->value / t - 1);
    };
    const Estimate* rmse = m.parameter("rmse_x");
    fmt::print(
        "{:40} {:4.0f} dB seed {}: k1 {:8.3f} k2 {:8.2f} c {:8.3f} e {:8.3f} %, terms {:2} + {:2}, rmse x {:.4f} "
        "mm{}\n",
        name, snr, seed, error("k1", truth.k1), error("k2", truth.k2), error("c", truth.c),
        error("e", std::abs(truth.eps)), m.equations[1].terms.size(), m.equations[3].terms.size(),
        rmse != nullptr ? rmse->value * 1e3 : std::nan(""), m.summary.status == Status::unusable ? "  DIVERGES" : "");
  };
  for (double snr : {200.0, 20.0}) {
    for (int seed = 1; seed <= (snr > 100 ? 1 : 3); ++seed) {
      const Recording r = record_of(snr, seed);
      const auto paper = [&](const char* name, double sd, const char* solver, regression::Selection s,
                             identification::PaperFilter f) {
        identification::PaperOptions o;
        o.filter_sd = sd;
        o.filter = f;
        o.solver.method = solver;
        o.solver.selection = s;
        print(name, snr, seed, identification::identify_paper(r, o));
      };
      paper("paper 6 ms ols", 6e-3, "ols", regression::Selection::automatic, identification::PaperFilter::data);
      paper("paper 6 ms lasso cv", 6e-3, "lasso", regression::Selection::cv, identification::PaperFilter::data);
      paper("paper 6 ms lasso bic", 6e-3, "lasso", regression::Selection::bic, identification::PaperFilter::data);
      paper("paper 6 ms lspl", 6e-3, "lspl", regression::Selection::bic, identification::PaperFilter::data);
      paper("paper 2 ms lasso bic", 2e-3, "lasso", regression::Selection::bic, identification::PaperFilter::data);
      paper("paper 6 ms twice lasso cv", 6e-3, "lasso", regression::Selection::cv,
            identification::PaperFilter::data_and_derivative);
      paper("equation 10 ms lasso bic", 10e-3, "lasso", regression::Selection::bic,
            identification::PaperFilter::equation);
      paper("equation 10 ms frols", 10e-3, "frols", regression::Selection::bic, identification::PaperFilter::equation);
      paper("equation 10 ms best subset", 10e-3, "best_subset", regression::Selection::bic,
            identification::PaperFilter::equation);
      if (seed == 1) {
        identification::PaperOptions o;
        o.filter = identification::PaperFilter::equation;
        o.filter_sd = 10e-3;
        for (const identification::ComparedFit& fit :
             identification::compare_regressors(identification::rotor_record(r), o)) {
          print(("  all regressors, equation: " + fit.method).c_str(), snr, seed, fit.model);
        }
      }
      print("consistent tied 10 ms", snr, seed, identification::identify_consistent(r));
    }
  }
}
