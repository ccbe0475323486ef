// The catalogue of file formats: a new one is its own source, one declaration in format.hpp and one line here.
#include "whirl/io/formats.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "format.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/names.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/record_stream.hpp"
#include "whirl/io/remarks.hpp"

namespace whirl::io {
namespace {

constexpr std::size_t kHead = (std::size_t{1} << 16) + 8;  // an HDF5 file may begin behind a user block

/// In the order in which contents and endings are looked at. CSV takes what no other knows.
const std::vector<Format>& formats() {
  static const std::vector<Format> all = {mat_format(),  mat4_format(), hdf5_format(), numpy_format(),
                                          tdms_format(), wav_format(),  lvm_format(),  json_format(),
                                          atfx_format(), uff_format(),  csv_format()};
  return all;
}

const Format& format_of(const std::filesystem::path& path) {
  ByteSource source(path);
  std::string head(kHead, '\0');
  head.resize(source.read(head.data(), head.size()));
  return *std::find_if(formats().begin(), formats().end(), [&](const Format& f) { return f.recognises(head); });
}

bool claims(const Format& format, std::string_view extension) {
  return std::find(format.extensions.begin(), format.extensions.end(), extension) != format.extensions.end();
}

std::string extension_of(std::filesystem::path path) {
  if (path.extension() == ".gz") path.replace_extension();
  return small_letters(path.extension().string());
}

/// ".h5, .mat or .csv": of the formats that have this.
template <class Function>
std::string endings(Function Format::*function) {
  std::vector<std::string_view> all;
  for (const Format& f : formats()) {
    if (f.*function != nullptr) all.push_back(f.extensions.front());
  }
  std::string text;
  for (std::size_t i = 0; i < all.size(); ++i) {
    text += fmt::format("{}{}", i == 0 ? "" : i + 1 == all.size() ? " or " : ", ", all[i]);
  }
  return text;
}

/// The format that the ending names, of those that have this. Throws Error in field OUT.
template <class Function>
const Format& named(const std::filesystem::path& path, Function Format::*function, const char* remark) {
  const std::string extension = extension_of(path);
  for (const Format& f : formats()) {
    if (f.*function != nullptr && claims(f, extension)) return f;
  }
  throw Error::in_field("OUT", path.string(), fmt::format("a file ending in {}{}", endings(function), remark));
}

}  // namespace

std::string_view without_blanks(std::string_view head) {
  if (head.starts_with("\xEF\xBB\xBF")) head.remove_prefix(3);
  head.remove_prefix(std::min(head.find_first_not_of(" \t\r\n"), head.size()));
  return head;
}

std::string_view words_of_ending(std::string_view ending) {
  const auto f = std::find_if(formats().begin(), formats().end(), [&](const Format& x) { return claims(x, ending); });
  return f == formats().end() ? std::string_view() : f->words;
}

std::string_view words_of_magic(std::string_view head) {
  const auto f =
      std::find_if(formats().begin(), formats().end(), [&](const Format& x) { return x.magic && x.recognises(head); });
  return f == formats().end() ? std::string_view() : f->words;
}

FileFormat file_format(const std::filesystem::path& path) { return format_of(path).id; }

SignalFile read_signals(const std::filesystem::path& path, const CsvOptions& options) {
  const Format& own = format_of(path);
  if (own.read == nullptr)
    throw Error::in_file(path.string(), 1,
                         fmt::format("{} holds results, not signals (`whirl report {}` shows them); records are CSV "
                                     "(t_s,x_mm,...) or another format "
                                     "of `whirl info --help`",
                                     own.words, path.string()));
  SignalFile file = own.read(path, options);
  const std::string extension = extension_of(path);
  const bool known =
      std::any_of(formats().begin(), formats().end(), [&](const Format& f) { return claims(f, extension); });
  if (known && !claims(own, extension)) {
    file.findings.push_back(fmt::format("named {} but its content is {}", extension, own.words));
  }
  for (SignalTable& table : file.tables) {
    table.name = one_line(table.name);
    for (Signal& signal : table.signals) signal.name = one_line(signal.name), signal.unit = one_line(signal.unit);
  }
  for (auto* list : {&file.contents, &file.findings}) {
    for (std::string& text : *list) text = one_line(text);
  }
  return file;
}

bool reads_in_parts(const std::filesystem::path& path) { return format_of(path).stream != nullptr; }

std::unique_ptr<SignalStream> open_signal_stream(const std::filesystem::path& file, const CsvOptions& options,
                                                 const PartRows& rows) {
  const Format& format = format_of(file);
  if (format.stream != nullptr) return format.stream(file, options, rows);
  std::string able;
  for (const Format& f : formats()) {
    if (f.stream != nullptr && able.find(f.words) == able.npos)
      able += fmt::format("{}{}", able.empty() ? "" : ", ", f.words);
  }
  throw Error::in_file(
      file.string(), 0,
      fmt::format("{} cannot be read in parts (above 1 GiB, or --stream); only {}", format.words, able));
}

std::unique_ptr<RecordStream> open_record_stream(const std::filesystem::path& file, const CsvOptions& options,
                                                 const PartRows& rows, std::function<void(double)> progress) {
  CsvOptions left = options;
  if (file_format(file) == FileFormat::csv) left.columns.clear();  // chosen where the lines are read
  return std::make_unique<RecordStream>(open_signal_stream(file, options, rows), left, rows.first, std::move(progress));
}

Converted convert_in_parts(const std::filesystem::path& in, const std::filesystem::path& out, const CsvOptions& options,
                           const PartRows& rows, std::function<void(double)> progress) {
  const Format& format = named(out, &Format::write_parts, ": the input is read in parts");
  std::unique_ptr<RecordStream> stream = open_record_stream(in, options, rows, progress);
  Recording first;
  Eigen::Index count = stream->rows();
  if (count == 0 && format.id != FileFormat::csv) {  // lines are counted by reading them
    while (stream->next(first)) count += first.size();
    stream = open_record_stream(in, options, rows, progress);
  }
  if (!stream->next(first)) throw Error::in_file(in.string(), 0, fmt::format("it has no row {}", rows.first));
  format.write_parts(out, first, *stream, count);
  return {first.channels.size(), stream->row() - rows.first, first.rate()};
}

bool is_large(const std::filesystem::path& file) {
  std::error_code none;
  return std::filesystem::is_regular_file(file, none) && std::filesystem::file_size(file, none) > kMostRead;
}

Recording read(const std::filesystem::path& path) { return read_recording(path); }

namespace {

/// Says what becomes of missing values; throws Error where the format has no place for them.
void tell_missing(const std::filesystem::path& path, const Recording& recording, const Format& format) {
  for (const Channel& c : recording.channels) {
    const Eigen::Index missing = c.samples.array().isNaN().count();
    if (missing == 0) continue;
    const std::string count = fmt::format("{}: {} of {} values are missing", c.name, missing, c.samples.size());
    if (format.missing.empty())
      throw Error::in_field("OUT", path.string(),
                            fmt::format("a file that has a place for missing values, .csv, .h5, .mat or .npz ({}). Or "
                                        "choose a part without gaps with --rows",
                                        count));
    remark(path.string(), fmt::format("{}; each is {} there", count, format.missing));
  }
}

}  // namespace

void write_recording(const std::filesystem::path& path, const Recording& recording) {
  const Format& format = named(path, &Format::write, " (text also with .gz behind)");
  check_with_gaps(recording);
  tell_missing(path, recording, format);
  format.write(path, recording);
}

std::optional<FrequencyResponse> read_responses(const std::filesystem::path& path, const ResponseOptions& options) {
  const Format& format = format_of(path);
  const bool arrays = format.id == FileFormat::mat || format.id == FileFormat::mat4 || format.id == FileFormat::hdf5 ||
                      format.id == FileFormat::numpy;
  if (!arrays && (!options.frequency_unit.empty() || options.lines_dimension != 0))
    throw Error::in_file(
        path.string(), 0,
        "--frequency-unit and --lines-dimension are for MAT, HDF5 and NumPy files: this one says both");
  return format.read_responses == nullptr ? std::nullopt : format.read_responses(path, options);
}

void write_responses(const std::filesystem::path& path, const FrequencyResponse& frf) {
  named(path, &Format::write_responses, ": the input holds frequency responses").write_responses(path, frf);
}

std::optional<FrfKind> frf_kind(std::string_view name) {
  if (name.empty()) return {};
  for (const FrfKind kind : {FrfKind::receptance, FrfKind::mobility, FrfKind::accelerance}) {
    if (to_string(kind) == name) return kind;
  }
  throw Error::in_field("--kind", std::string(name), "receptance, mobility or accelerance");
}

Quantity motion_of(FrfKind kind) {
  return kind == FrfKind::receptance ? Quantity::displacement
         : kind == FrfKind::mobility ? Quantity::velocity
                                     : Quantity::acceleration;
}

std::optional<FrfKind> kind_of_motion(Quantity motion) {
  for (const FrfKind kind : {FrfKind::receptance, FrfKind::mobility, FrfKind::accelerance})
    if (motion_of(kind) == motion) return kind;
  return {};
}

std::string readable_formats() {
  std::string text;
  std::string_view last;
  for (const Format& f : formats()) {
    if (f.read == nullptr || f.words == last) continue;  // MAT 4 and 5 are neighbours of one name
    text += fmt::format("{}{}", text.empty() ? "" : ", ", f.words);
    last = f.words;
  }
  return text;
}

std::string recording_endings() { return endings(&Format::write); }

}  // namespace whirl::io
