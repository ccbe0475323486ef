#pragma once
#include "whirl/core/modal_model.hpp"

namespace whirl::modal {

/// FRFs that an analyser averaged from random force through Hann windows, with that window exchanged for an exponential
/// one (`window_decay`), which every fit knows how to take off.
///
/// Random force through a window w makes of H its mean over neighbouring lines, H * |W|^2: the impulse response h(t)
/// is multiplied by the autocorrelation of the window (Bendat and Piersol, Random Data, ch. 11). Of a block of 1/df it
/// is seen in full at t = 0, to a sixth at half the block and not at all at its end. It is divided by that and
/// multiplied by exp(-sigma t), which leaves nothing where the autocorrelation is small. Six lines at either end, whose
/// neighbours are not there, are dropped; variances are scaled alike, coherences are gone. Throws Error for fewer than
/// 64 lines, values that are no numbers, or FRFs that state a window or none.
FrequencyResponse without_hann_window(const FrequencyResponse& frf);

/// States that the records behind `frf` went through an exponential window that ends at the share `end` of its start,
/// in (0, 1): every fit takes its decay off. Throws Error where the responses state a window, or have fewer than two
/// lines.
void state_exponential_window(FrequencyResponse& frf, double end);

/// True when half of the modes or more stand within three lines of another, as where a Hann window splits every narrow
/// peak. Structures of two equal directions look so too: a sign, no proof.
bool looks_split(const FrequencyResponse& frf, const ModalModel& model);

/// norm(measured - model) / norm(measured) of the lines as they were measured. `model`: fitted to `without`, which is
/// `without_hann_window(measured)`; it is shown through the Hann window again.
double error_through_hann_window(const FrequencyResponse& measured, const FrequencyResponse& without,
                                 const ModalModel& model);

}  // namespace whirl::modal
