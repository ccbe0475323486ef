// Exact support of the canonical systems with default settings: found / missed / false terms, largest coefficient
// error; how often the whole verdict, with a part held out, is not ok, and unusable.
// Usage: bench_identify_zoo [seeds = 1] [system | all | wide: long searches] [regression: no refinement]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>

#include "whirl/identify/identify.hpp"
#include "whirl/testing/zoo.hpp"

using namespace whirl;

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 1;
  const std::string only = argc > 2 ? argv[2] : "";
  const bool refine = argc <= 3;
  std::vector<testing::ZooSystem> systems = only == "wide" ? testing::wide_zoo() : testing::zoo();
  if (!only.empty() && only != "all" && only != "wide") {
    for (testing::ZooSystem& s : testing::wide_zoo()) systems.push_back(std::move(s));
    std::erase_if(systems, [&](const testing::ZooSystem& s) { return s.name != only; });
  }
  for (const testing::ZooSystem& s : systems) {
    for (double noise : {0.0, 0.001, 0.01, 0.05}) {
      int exact = 0, missed = 0, extra = 0, doubted = 0, unusable = 0;
      double worst = 0, seconds = 0, chi = 0;
      std::string wrong;
      for (int seed = 1; seed <= seeds; ++seed) {
        const Recording r = testing::zoo_record(s, noise, static_cast<std::uint64_t>(seed));
        identification::IdentifyOptions whole;
        whole.method = identification::Method::sindy;
        identification::SindyOptions& o = whole.sindy;
        o.states = s.truth.states;
        o.inputs = s.truth.inputs;
        o.library = s.library;
        o.refine = refine;
        const std::clock_t t0 = std::clock();
        const IdentifiedModel m = identification::fit_sindy({r}, o);
        seconds += static_cast<double>(std::clock() - t0) / CLOCKS_PER_SEC;
        const identification::Identification judged = identification::identify(r, whole);
        doubted += judged.summary.status != Status::ok;
        unusable += judged.summary.status == Status::unusable;
        if (judged.summary.status != Status::ok) wrong += " [" + judged.summary.warnings.back() + "]";
        chi = m.summary.chi_square;
        int miss = 0, more = 0;
        for (std::size_t e = 0; e < s.truth.equations.size(); ++e) {
          const Equation& truth = s.truth.equations[e];
          const auto found = std::find_if(m.equations.begin(), m.equations.end(),
                                          [&](const Equation& q) { return q.lhs == truth.lhs; });
          for (const EquationTerm& t : truth.terms) {
            const expr::Expr f = expr::Expr::parse(t.function);
            const auto at = std::find_if(found->terms.begin(), found->terms.end(),
                                         [&](const EquationTerm& q) { return expr::Expr::parse(q.function) == f; });
            if (at == found->terms.end()) {
              ++miss;
              wrong += " -" + t.function;
            } else {
              worst = std::max(worst, std::abs(at->coefficient.value / t.coefficient.value - 1));
            }
          }
          for (const EquationTerm& t : found->terms) {
            const expr::Expr f = expr::Expr::parse(t.function);
            if (std::none_of(truth.terms.begin(), truth.terms.end(),
                             [&](const EquationTerm& q) { return expr::Expr::parse(q.function) == f; })) {
              ++more;
              wrong += " +" + t.function;
            }
          }
        }
        missed += miss;
        extra += more;
        exact += miss + more == 0;
      }
      fmt::print(
          "{:15} noise {:4.1f} %: exact {}/{}, missed {}, false {}, worst coefficient {:.2g} %, chi2 {:.3g}, not ok "
          "{}, "
          "unusable {}, {:.2f} s cpu{}\n",
          s.name, 100 * noise, exact, seeds, missed, extra, 100 * worst, chi, doubted, unusable, seconds / seeds,
          wrong);
      std::fflush(stdout);
    }
  }
}
