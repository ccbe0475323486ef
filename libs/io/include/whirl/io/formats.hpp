#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "whirl/core/modal_model.hpp"
#include "whirl/core/recording.hpp"

/// What can be done with a file of any format: the catalogue of formats decides (libs/io/src/formats/formats.cpp).
/// Reading of records: `read_recording`, `read_signals` in signals.hpp.
namespace whirl::io {

/// A recording from any file that whirl reads (docs/formats.md), by `read_recording` of signals.hpp with its defaults.
/// Throws Error naming file and line.
Recording read(const std::filesystem::path& path);

/// Writes a record in SI in the format that the ending names; `.gz` behind it is packed. Throws Error in field OUT with
/// the endings that can be written.
void write_recording(const std::filesystem::path& path, const Recording& recording);

/// What a file of frequency responses may leave open.
struct ResponseOptions {
  std::optional<FrfKind> kind = {};  ///< what was measured, in SI where the file states no unit
  std::string frequency_unit = {};   ///< of an axis without unit in a MAT, HDF5 or NumPy file: hz, kHz, rad_s, rpm
  int lines_dimension = 0;           ///< of arrays in these: the one along the frequencies, from 1; 0: by its length

  ResponseOptions() = default;
  ResponseOptions(std::optional<FrfKind> what) : kind(what) {}
  ResponseOptions(FrfKind what) : kind(what) {}
};

/// Frequency responses of a file of any format; nothing when it holds a record or something else.
///
/// Throws Error where the file leaves something open that `options` do not state, and where they state what the file
/// says itself.
std::optional<FrequencyResponse> read_responses(const std::filesystem::path& path, const ResponseOptions& options = {});

/// The kind named "receptance", "mobility" or "accelerance"; nothing for an empty name.
std::optional<FrfKind> frf_kind(std::string_view name);

/// Writes frequency responses in the format that the ending names. Throws as `write_recording`.
void write_responses(const std::filesystem::path& path, const FrequencyResponse& frf);

/// The formats that can be read, for messages and help: "MAT, HDF5, WAV, ...".
std::string readable_formats();

/// The endings of formats that a record can be written to, for messages: ".h5, .mat, ... or .csv".
std::string recording_endings();

}  // namespace whirl::io
