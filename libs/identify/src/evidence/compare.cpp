#include "whirl/identify/compare.hpp"

#include <fmt/format.h>

#include <ctime>
#include <limits>

#include "evidence/channel_units.hpp"
#include "evidence/compare_all.hpp"
#include "evidence/record_quality.hpp"
#include "problem/sindy_prepare.hpp"
#include "whirl/core/error.hpp"

namespace whirl::identification {
namespace detail {

std::vector<ComparedFit> compare_all(std::size_t terms, const regression::SolveOptions& options,
                                     const std::function<IdentifiedModel(const regression::SolveOptions&)>& fit) {
  constexpr std::size_t kMostOfBestSubset = 40;
  std::vector<ComparedFit> fits;
  for (const std::string& method : regression::regression_methods()) {
    regression::SolveOptions solver = options;
    solver.method = method;
    solver.selection = regression::Selection::automatic;
    fits.push_back(timed_fit(method, [&] {
      if (method == "best_subset" && terms > kMostOfBestSubset) {
        throw Error(fmt::format("not run: {} terms, at most {} are practical", terms, kMostOfBestSubset));
      }
      return fit(solver);
    }));
    fits.back().model.method = method;
  }
  return fits;
}

ComparedFit timed_fit(const std::string& name, const std::function<IdentifiedModel()>& fit) {
  ComparedFit row;
  row.method = name;
  const std::clock_t begin = std::clock();
  try {
    row.model = fit();
  } catch (const Error& e) {
    row.model.summary.fail(e.what());
  }
  row.seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  for (const Equation& e : row.model.equations) {
    for (const EquationTerm& t : e.terms) row.terms += t.coefficient.sd != 0;
  }
  return row;
}

}  // namespace detail

std::vector<ComparedFit> compare_regressors(const std::vector<Recording>& records, const SindyOptions& options) {
  Summary summary;
  detail::check_signals(records, options.states, options.inputs, options.discrete, summary);
  if (summary.status == Status::unusable) throw Error(summary.reason);
  detail::SindyData data(options);
  data.add(records, std::numeric_limits<Eigen::Index>::max());
  data.finish();
  std::size_t most = 0;
  for (const auto& [lhs, terms] : data.candidates()) most = std::max(most, terms.size());
  return detail::compare_all(most, options.solver, [&](const regression::SolveOptions& solver) {
    IdentifiedModel model = detail::regress(data, solver).model;
    detail::set_coefficient_units(model, records.front());
    return model;
  });
}

}  // namespace whirl::identification
