#pragma once
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/expr/library.hpp"
#include "whirl/identify/paper.hpp"
#include "whirl/identify/sindy.hpp"
#include "whirl/regression/regression.hpp"

namespace whirl::identification {

/// One regression method on the same record and library as the others.
struct ComparedFit {
  std::string method;     ///< of regression_methods()
  IdentifiedModel model;  ///< summary.residual: largest rms residual of an equation by the rms of its left-hand side
  int terms = 0;          ///< kept in all equations sought
  double seconds = 0;     ///< processor time of the regression, shared sums not included
};

/// Eq. 24 (or `options.library`) on a rotor record, by the chain of identify_paper, with every method of `solve`;
/// `options.solver` gives their parameters. Methods that fail are unusable with their reason. Throws Error for a record
/// that cannot give a rotor.
std::vector<ComparedFit> compare_regressors(const RotorRecord& record, const PaperOptions& options = {});
/// The weak form of fit_sindy, without refinement, with every method of `solve`. Throws Error as fit_sindy, and for
/// records that it calls unusable.
std::vector<ComparedFit> compare_regressors(const std::vector<Recording>& records, const SindyOptions& options);
/// The same of fit_library: ties and known parts kept by every method, tied groups never dropped.
std::vector<ComparedFit> compare_regressors(const std::vector<Recording>& records,
                                            const expr::CandidateLibrary& library, const SindyOptions& options = {});

}  // namespace whirl::identification
