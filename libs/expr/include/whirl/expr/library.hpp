#pragma once
#include <complex>
#include <string>
#include <vector>

#include "whirl/expr/expr.hpp"
#include "whirl/expr/unit.hpp"

namespace whirl::expr {

/// Every monomial of the variables from degree `low` (0: the constant) to degree `high`, by degree.
std::vector<Expr> polynomial_library(const std::vector<std::string>& variables, int high, int low = 0);
/// sin(k v), cos(k v) for k = 1..harmonics and every variable.
std::vector<Expr> fourier_library(const std::vector<std::string>& variables, int harmonics);
/// The 17 functions of paper eq. 24 without exponentials, with Y1, Y2 read as X3, X4:
/// 1, X1, X1^3, X2, X6^2 cos X5, X6^2 sin X5, X6 cos X5, X6 sin X5, X3, X3^3, X4, X1 X3^2, X1^2 X3, X6, X6^2, sin X5,
/// cos X5.
std::vector<Expr> rotor_library();
/// exp(Re(p) t) cos(Im(p) t) and exp(Re(p) t) sin(Im(p) t) for every pole p, rad/s (paper eq. 24, e^{lambda t}, as real
/// columns), with t counted from `onset` (s): multiplied by (1 + sgn(t - onset))/2 when the onset is not 0.
std::vector<Expr> modal_library(const std::vector<std::complex<double>>& poles, double onset = 0);
/// Terms of all libraries in order, each function once; terms that differ by a numeric factor are the same function.
std::vector<Expr> union_library(const std::vector<std::vector<Expr>>& libraries);
/// Parses a list of terms; an error names the entry.
std::vector<Expr> parse_library(const std::vector<std::string>& terms);

/// One place where an unknown of a library stands: factor * function in the equation with this index.
struct TiedEntry {
  std::size_t equation = 0;
  Expr function;
  double factor = 1;
};

/// One unknown of the regression with every place where it stands (a tie across axes and functions).
struct TiedGroup {
  std::string name;  ///< e.g. "k1", or the text of the function when there is one entry
  std::vector<TiedEntry> entries;
  std::string coefficient;  ///< the unknown in physical parameters, e.g. "K1/m"; empty when it has no such meaning
  std::string unit;         ///< SI unit of the unknown; empty when not known
};

/// Candidate terms of all equations: lhs[i] = known[i] + sum over groups of unknown * sum over entries with equation i.
struct CandidateLibrary {
  std::vector<std::string> lhs;        ///< e.g. {"X2'", "X4'"}
  std::vector<std::string> variables;  ///< all names the functions and `known` use, natural order
  std::vector<TiedGroup> groups;
  std::vector<Expr> known;  ///< fixed part of each equation, one per lhs; empty: none
};

/// The unknown that multiplies terms[i] in equation i (0: it does not stand there). A sum stays one function; the
/// number in front of a single term goes to the factor.
TiedGroup tied_group(std::string name, const std::vector<Expr>& terms, std::string coefficient = "",
                     std::string unit = "");
/// The reverse: what the group puts into each of n equations.
std::vector<Expr> group_terms(const TiedGroup& group, std::size_t n);
/// Library of these groups. Throws Error when an equation is named twice, an entry names an equation that is not there,
/// a group has no entry, two groups of more than one entry have one name, or `known` is neither empty nor one per
/// equation.
CandidateLibrary make_library(std::vector<std::string> lhs, std::vector<TiedGroup> groups,
                              std::vector<Expr> known = {});
/// known[i] + sum over groups of unknown[g] * factor * function in equation i.
std::vector<Expr> right_hand_sides(const CandidateLibrary& library, const std::vector<Expr>& unknowns);

/// The five-parameter rotor (paper eqs. 5, 13; RotorModel): groups k1, k2, c, eps_re, eps_im over "X2'", "X4'", then
/// "d_re", "d_im" (constant) when `offset`. `anisotropic` adds k1_conj_re, k1_conj_im, c_conj_re, c_conj_im; `control`
/// adds gain with inputs ux, uy.
CandidateLibrary tied_rotor_library(bool offset = true, bool anisotropic = false, bool control = false);

}  // namespace whirl::expr
