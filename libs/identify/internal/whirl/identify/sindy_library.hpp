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
/// up to the whole record while the model follows; candidates with |t| < `options.search.t_value` are dropped.
/// `parameters` of the result are the unknowns by group name (several groups of one name, a term in two equations: "x':
/// v"), with `parameter_covariance`; summary and errors as fit_sindy.
IdentifiedModel fit_library(const std::vector<Recording>& records, const expr::CandidateLibrary& library,
                            const SindyOptions& options = {});

/// The library with channels x, y, beta and their derivatives in place of the rotor states X1 .. X7 (X1' = X2 and X3' =
/// X4 leave out; X2' becomes x'', X4' y'').
expr::CandidateLibrary in_channel_names(const expr::CandidateLibrary& library);
/// The record with channels "u'", "u''" computed for every name that ends in primes and is not there; named angles are
/// made continuous and smooth.
Recording with_derivatives(const Recording& record, const std::vector<std::string>& names);

/// Candidate terms by kind.
struct LibraryChoice {
  int degree = 0;   ///< all monomials up to it; 0: 3, or 2 beyond three variables and for `quadratic`
  int fourier = 0;  ///< sin(k v), cos(k v) of every variable up to k
  bool time = false;
  bool quadratic = false;               ///< the system is to be one up to degree 2 (IdentifyOptions::trapping)
  std::vector<std::string> terms = {};  ///< further ones; alone they are the library
};
/// The terms in the states (and their rates, order 2) and inputs of `options`, for `SindyOptions::library`.
std::vector<std::string> library_terms(const SindyOptions& options, const LibraryChoice& choice);

/// "v' = -2*x + 0.1*v^3" as an equation with fixed coefficients, for `SindyOptions::known`. Throws Error.
Equation known_equation(const std::string& text);
/// "x^3=-" (in every equation) or "v':x^3=+", for `SindyOptions::signs`. Throws Error.
SignBound sign_bound(const std::string& text);

}  // namespace whirl::identification
