#pragma once
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/expr/library.hpp"
#include "whirl/identify/sindy.hpp"

namespace whirl::identification {

/// Sparse identification with exactly the terms of a library: ties across equations, known parts, physical groups.
///
/// The left-hand sides say what is sought: x'' (from displacements alone), x' or x[k+1]; an equation that is nothing
/// but its known part is kept as it is. Other names are inputs: channels of the records, or their derivatives (beta',
/// beta'': a rotor angle by angle_from_encoder, any other channel by the smoothing spline). X1 .. X7 of rotor libraries
/// are read as x, x', y, y', beta, beta', beta'' when the records have no channel X1. States, inputs, order, map and
/// library of `options` are taken from the library.
///
/// Weak form of all equations together, each weighted by its residual variance, in the unknowns of the groups; groups
/// that are tied (several entries) or have a physical coefficient stay, single candidates are selected by
/// `options.solver`. Then refinement on free runs with the ties kept (refine_free_run), from one characteristic period
/// up to the whole record while the model follows; candidates with |t| < `options.t_value` are dropped. `parameters` of
/// the result are the unknowns by group name (several groups of one name, a term in two equations: "x': v"), with
/// `parameter_covariance`; summary and errors as fit_sindy.
IdentifiedModel fit_library(const std::vector<Recording>& records, const expr::CandidateLibrary& library,
                            const SindyOptions& options = {});

/// The library with channels x, y, beta and their derivatives in place of the rotor states X1 .. X7 (X1' = X2 and X3' =
/// X4 leave out; X2' becomes x'', X4' y'').
expr::CandidateLibrary in_channel_names(const expr::CandidateLibrary& library);
/// The record with channels "u'", "u''" computed for every name that ends in primes and is not there; named angles are
/// made continuous and smooth.
Recording with_derivatives(const Recording& record, const std::vector<std::string>& names);

}  // namespace whirl::identification
