#pragma once
#include <filesystem>

#include "whirl/tuning/design.hpp"

namespace whirl::io {
class Json;
}

namespace whirl::tuning {

/// Reads whirl.law/1: a linear law from displacement (m) and, where it has twice the inputs, velocity (m/s) to force
/// (N).
///
///   A, B, C, D            both axes together: inputs x, y or x, y, v_x, v_y; outputs f_x, f_y
///   x, y: {A, B, C, D}    one axis each: its displacement, or displacement and velocity; without `y` both are alike
///   x, y: {num, den}      a transfer function of one axis, coefficients of s or z, highest power first
///
/// `sample_time_s` says that the numbers are those of a sampled law, of this sample time. Without it they are
/// continuous, and are sampled at `sample_time` by the bilinear rule (Tustin).
///
/// Throws Error with file and place for matrices that do not fit, numbers that are not finite, orders above
/// control::LinearAxis::kOrder, a transfer function with more zeros than poles, another sample time than that of the
/// loop and a pole at 2 / sample time.
OwnLaw read_law(const io::Json& document, const std::filesystem::path& file, double sample_time);

}  // namespace whirl::tuning
