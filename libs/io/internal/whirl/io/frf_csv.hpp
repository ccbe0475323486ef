#pragma once
#include <filesystem>

#include "whirl/core/modal_model.hpp"
#include "whirl/io/csv.hpp"

namespace whirl::io {

/// The axis of such a table: `freq`, `frequency` or `f`, in whatever unit of a frequency.
bool is_frequency_axis(const Channel& column);

/// Frequency responses from a table `freq_hz,H1_re,H1_im,H2_re,H2_im,...` with, where known,
/// `H1_coherence_1`. The file does not say what was measured: `kind` does, and the values are in its SI unit
/// (m/N, m/(s N), m/(s^2 N)).
///
/// Throws Error when a part is missing, a column does not belong, or the frequencies are not uniform (each
/// within 5 % of a step, as for times).
FrequencyResponse read_frf_csv(const std::filesystem::path& path, FrfKind kind);
FrequencyResponse frf_from_table(const Table& table, FrfKind kind);

/// Writes that table. Channels are called by their response point, or H1, H2, ... where these cannot be CSV
/// headers or are not unique.
void write_frf_csv(const std::filesystem::path& path, const FrequencyResponse& frf);

}  // namespace whirl::io
