#pragma once
#include "whirl/modal/poles.hpp"
#include "whirl/modal/residues.hpp"

namespace whirl {

struct ModeOptions {
  PoleOptions poles;          ///< band, weighting and orders of the start
  ResidueOptions residues;    ///< which residuals; its band and weighting follow `poles`
  bool refine = true;         ///< Gauss-Newton on all poles; gives the covariance
  int max_iterations = 12;    ///< of one refinement
  bool search = true;         ///< look in what is left for weak modes that no order showed
  double search_gain = 25;    ///< energy of a new pole over that of noise in the same directions
  int max_modes = 200;
};

/// Modes of a set of FRFs, from the lines to poles, residues and residuals with their uncertainty.
///
/// pLSCF start, automatic selection, Gauss-Newton by variable projection over the poles alone, then search of the residual
/// for modes that were missed. Frequencies and damping are those of the structure: the decay of an exponential window is
/// removed, and both values are reported in the summary. Their standard deviations assume independent line noise.
/// A mode whose sharpness the lines cannot resolve, or that the data do not support, is dropped or warned about.
ModalModel fit_modes(const FrequencyResponse& frf, const ModeOptions& options = {});

}  // namespace whirl
