#include "whirl/io/signals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/io/atfx.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/input.hpp"
#include "whirl/io/uff.hpp"

namespace whirl::io {
namespace {

struct FormatName {
  FileFormat format;
  const char* words;
  std::vector<std::string_view> extensions;
};
const std::vector<FormatName>& formats() {
  static const std::vector<FormatName> all = {{FileFormat::csv, "CSV", {".csv", ".txt", ".tsv"}},
                                              {FileFormat::uff, "universal file", {".uff", ".unv"}},
                                              {FileFormat::atfx, "ATFX", {".atfx"}},
                                              {FileFormat::mat, "MAT", {".mat"}},
                                              {FileFormat::hdf5, "HDF5", {".h5", ".hdf5", ".mat"}},
                                              {FileFormat::wav, "WAV", {".wav"}},
                                              {FileFormat::lvm, "LVM", {".lvm"}},
                                              {FileFormat::json, "JSON", {".json"}}};
  return all;
}

// From the first bytes, whatever the name says.
FileFormat format_of(std::string_view head) {
  constexpr std::string_view kHdf5("\x89HDF\r\n\x1a\n", 8);
  if (head.starts_with(kHdf5) || head.starts_with("MATLAB 7.3")) return FileFormat::hdf5;
  if (head.starts_with("MATLAB 5.0")) return FileFormat::mat;
  if (head.size() >= 12 && (head.starts_with("RIFF") || head.starts_with("RIFX") || head.starts_with("RF64")) &&
      head.substr(8, 4) == "WAVE") {
    return FileFormat::wav;
  }
  if (head.starts_with("\xEF\xBB\xBF")) head.remove_prefix(3);
  if (head.starts_with("LabVIEW Measurement")) return FileFormat::lvm;
  const std::size_t first = head.find_first_not_of(" \t\r\n");
  if (first == std::string_view::npos) return FileFormat::csv;
  if (head[first] == '{') return FileFormat::json;
  if (head.substr(first).starts_with("<?xml") || head.substr(first).starts_with("<atfx_file")) return FileFormat::atfx;
  // Blocks of a universal file begin with -1 alone on a line, perhaps after some text.
  for (std::size_t at = 0; at < head.size();) {
    const std::size_t end = std::min(head.find('\n', at), head.size());
    std::string_view line = head.substr(at, end - at);
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back())) != 0) line.remove_suffix(1);
    while (!line.empty() && line.front() == ' ') line.remove_prefix(1);
    if (line == "-1") return FileFormat::uff;
    at = end + 1;
  }
  return FileFormat::csv;
}

SignalFile signals_from_csv(const std::filesystem::path& path, const CsvOptions& options) {
  SignalFile file;
  CsvDialect dialect;
  const bool timed = options.rate.has_value() || CsvStream(path, options).time_column() >= 0;
  SignalTable table;
  std::vector<Channel> channels;
  if (timed) {
    Recording recording = read_csv(path, options, &dialect);
    table.abscissa = Quantity::time;
    table.start = recording.t0;
    table.step = recording.dt;
    channels = std::move(recording.channels);
    file.format = to_string(dialect);
  } else {
    channels = read_table(path, options).columns;
    file.format = "CSV table";
    if (!channels.empty() && channels.front().name == "freq" && channels.front().quantity == Quantity::frequency) {
      set_abscissa(table, Quantity::frequency, channels.front().samples);
      channels.erase(channels.begin());
    }
  }
  for (Channel& channel : channels) {
    table.signals.push_back(
        {channel.name, std::string(si_unit(channel.quantity)), channel.quantity, std::move(channel.samples), {}});
  }
  file.source = path.string();
  file.tables.push_back(std::move(table));
  return file;
}

// "HEADER:name_unit*factor"
struct Choice {
  std::string header, name;
  const UnitSuffix* unit = nullptr;  ///< null: that of the file
  double factor = 1;
};

Choice parse_choice(const std::string& text, const std::vector<const Signal*>& signals) {
  const auto present = [&](std::string_view name) {
    return std::any_of(signals.begin(), signals.end(), [&](const Signal* s) { return s->name == name; });
  };
  Choice choice;
  if (present(text)) {
    choice.header = choice.name = text;
    return choice;
  }
  const std::size_t colon = text.rfind(':');
  std::string wanted = colon == std::string::npos ? text : text.substr(colon + 1);
  if (const std::size_t star = wanted.rfind('*'); star != std::string::npos) {
    const char *first = wanted.data() + star + 1, *last = wanted.data() + wanted.size();
    const auto [end, error] = std::from_chars(first, last, choice.factor);
    if (error != std::errc() || end != last || !std::isfinite(choice.factor) || choice.factor == 0) {
      throw Error::in_field("--columns", text, "HEADER:name_unit*FACTOR with a number that is not zero");
    }
    wanted.resize(star);
  }
  const NameWithUnit split = split_unit(wanted);
  choice.name = split.unit != nullptr ? split.name : wanted;
  choice.header = colon == std::string::npos ? choice.name : text.substr(0, colon);
  choice.unit = split.unit;
  if (colon != std::string::npos && split.unit == nullptr) throw Error(unit_problem(wanted));
  if (choice.factor != 1 && split.unit == nullptr) throw Error::in_field("--columns", text, "HEADER:name_unit*FACTOR");
  return choice;
}

}  // namespace

FileFormat file_format(const std::filesystem::path& path) {
  ByteSource source(path);
  std::string head(4096, '\0');
  head.resize(source.read(head.data(), head.size()));
  return format_of(head);
}

SignalFile read_signals(const std::filesystem::path& path, const CsvOptions& options) {
  const FileFormat format = file_format(path);
  SignalFile file;
  const std::string name = path.string();
  switch (format) {
    case FileFormat::csv:
      file = signals_from_csv(path, options);
      break;
    case FileFormat::uff:
      file = signals_from_uff(read_uff(path));
      break;
    case FileFormat::atfx:
      file = signals_from_atfx(read_atfx(path));
      break;
    case FileFormat::mat:
      file = parse_mat(read_text(path), name);
      break;
    case FileFormat::hdf5:
      probe_hdf5(name, [&] { (void)parse_hdf5(read_text(path), name); });
      file = parse_hdf5(read_text(path), name);
      break;
    case FileFormat::wav:
      file = parse_wav(read_text(path), name);
      break;
    case FileFormat::lvm:
      file = parse_lvm(read_text(path), name);
      break;
    case FileFormat::json:
      throw Error::in_file(name, 1, "JSON holds results, not signals");
  }
  std::filesystem::path plain = path;
  if (plain.extension() == ".gz") plain.replace_extension();
  std::string extension = plain.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  const auto claims = [&](const FormatName& f) {
    return std::find(f.extensions.begin(), f.extensions.end(), extension) != f.extensions.end();
  };
  const auto own =
      std::find_if(formats().begin(), formats().end(), [&](const FormatName& f) { return f.format == format; });
  const auto other = std::find_if(formats().begin(), formats().end(), claims);
  if (other != formats().end() && !claims(*own)) {
    file.findings.push_back(fmt::format("named {} but its content is {}", extension, own->words));
  }
  return file;
}

Recording recording_of(const SignalFile& file, const CsvOptions& options) {
  const auto fail = [&](const std::string& message) -> Error { return Error::in_file(file.source, 0, message); };
  std::vector<const Signal*> signals;
  std::vector<const SignalTable*> tables;
  for (const SignalTable& table : file.tables) {
    for (const Signal& signal : table.signals) {
      if (signal.imaginary.size() > 0 || (table.abscissa && *table.abscissa != Quantity::time)) continue;
      if (signal.quantity == Quantity::time && signal.name == "t") continue;
      signals.push_back(&signal);
      tables.push_back(&table);
    }
  }
  if (signals.empty()) throw fail(fmt::format("{} without a channel over time", file.format));
  std::vector<Choice> choices;
  std::vector<std::size_t> chosen;
  for (const std::string& text : options.columns) {
    Choice choice = parse_choice(text, signals);
    std::size_t at = 0;
    while (at < signals.size() && signals[at]->name != choice.header) ++at;
    if (at == signals.size()) {
      std::size_t number = 0;
      const auto [end, error] =
          std::from_chars(choice.header.data(), choice.header.data() + choice.header.size(), number);
      if (error == std::errc() && end == choice.header.data() + choice.header.size() && number >= 1 &&
          number <= signals.size()) {
        at = number - 1;
      } else {
        std::string present;
        for (const Signal* s : signals) present += (present.empty() ? "" : ", ") + s->name;
        throw fail(fmt::format("no channel '{}'; present: {}", choice.header, present));
      }
    }
    chosen.push_back(at);
    choices.push_back(std::move(choice));
  }
  if (options.columns.empty()) {
    for (std::size_t i = 0; i < signals.size(); ++i) {
      chosen.push_back(i);
      choices.push_back({signals[i]->name, signals[i]->name});
    }
  }

  Recording recording;
  recording.source = file.source;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const Signal& signal = *signals[chosen[i]];
    const SignalTable& table = *tables[chosen[i]];
    double step = table.step;
    if (table.x.size() > 0) throw fail(fmt::format("channel '{}': its times are not uniform", signal.name));
    if (options.rate) {
      require_range("rate", *options.rate, 1e-9, 1e12, "Hz");
      if (step > 0 && std::abs(*options.rate * step - 1) > 1e-3) {
        throw fail(fmt::format("the rate given is {} Hz, but channel '{}' has {:.9g} Hz", *options.rate, signal.name,
                               1 / step));
      }
      step = 1 / *options.rate;
    }
    if (!(step > 0))
      throw fail(fmt::format("channel '{}' states no times: state the sample rate (--rate, Hz)", signal.name));
    if (i == 0) {
      recording.dt = step;
      recording.t0 = table.start;
    } else if (std::abs(step - recording.dt) > 1e-6 * recording.dt || signal.value.size() != recording.size() ||
               std::abs(table.start - recording.t0) > 0.05 * recording.dt) {
      throw fail(
          fmt::format("channel '{}' has other times ({} samples at {:g} Hz) than '{}': choose channels with --columns",
                      signal.name, signal.value.size(), 1 / step, recording.channels.front().name));
    }
    std::optional<Quantity> quantity = signal.quantity;
    Eigen::VectorXd value = signal.value;
    if (const UnitSuffix* unit = choices[i].unit) {
      if (!quantity) {
        value = value.unaryExpr([&](double v) { return unit->to_si(choices[i].factor * v); });
        quantity = unit->quantity;
      } else if (*quantity != unit->quantity || choices[i].factor != 1) {
        throw fail(fmt::format("channel '{}' is in {} by the file: it cannot be taken in {}", signal.name, signal.unit,
                               unit->suffix));
      }
    }
    if (!quantity) {
      throw fail(fmt::format("channel '{}' has {}: state it with --columns '{}:name_unit' (units: {})", signal.name,
                             signal.unit.empty() ? "no unit" : fmt::format("the unknown unit '{}'", signal.unit),
                             signal.name, allowed_units()));
    }
    std::string name = choices[i].name;
    if (name.empty() || recording.has(name)) name += fmt::format("#{}", i + 1);
    recording.add(std::move(name), *quantity, std::move(value));
  }
  for (const std::string& required : options.required) {
    const NameWithUnit split = split_unit(required);
    const Channel* channel = recording.find(split.unit != nullptr ? split.name : required);
    if (channel == nullptr || (split.unit != nullptr && channel->quantity != split.unit->quantity))
      recording.at(required);
  }
  if (recording.size() < options.min_samples) {
    throw fail(fmt::format("{} samples; at least {} are needed", recording.size(), options.min_samples));
  }
  recording.check();
  return recording;
}

Recording read_recording(const std::filesystem::path& path, const CsvOptions& options) {
  return file_format(path) == FileFormat::csv ? read_csv(path, options)
                                              : recording_of(read_signals(path, options), options);
}

const UnitSuffix* unit_from_label(std::string_view label) {
  std::string text(label);
  for (const auto& [from, to] : {std::pair<std::string_view, std::string_view>{"\xC2\xB2", "2"},
                                 {"\xC2\xB5", "u"},
                                 {"\xCE\xBC", "u"},
                                 {"**", ""},
                                 {"^", ""},
                                 {"(", ""},
                                 {")", ""},
                                 {"[", ""},
                                 {"]", ""},
                                 {" ", ""},
                                 {"/", "_"}}) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
      text.replace(at, from.size(), to);
    }
  }
  for (const auto& [word, suffix] : {std::pair<std::string_view, std::string_view>{"sec", "s"},
                                     {"seconds", "s"},
                                     {"Seconds", "s"},
                                     {"G", "g"},
                                     {"volt", "V"},
                                     {"Volt", "V"},
                                     {"volts", "V"},
                                     {"Volts", "V"},
                                     {"newton", "N"},
                                     {"Newton", "N"},
                                     {"newtons", "N"},
                                     {"Newtons", "N"},
                                     {"RPM", "rpm"},
                                     {"-", "1"},
                                     {"%", "percent"}}) {
    if (text == word) text = suffix;
  }
  return text.empty() ? nullptr : find_unit(text);
}

Signal make_signal(std::string name, std::string_view unit_label, Eigen::VectorXd value) {
  Signal signal{std::move(name), std::string(unit_label), {}, std::move(value), {}};
  const UnitSuffix* unit = unit_from_label(unit_label);
  if (unit_label.empty()) {
    const NameWithUnit split = split_unit(signal.name);
    if (split.unit != nullptr && !split.name.empty()) {
      unit = split.unit;
      signal.name = split.name;
      signal.unit = unit->suffix;
    }
  }
  if (unit != nullptr) {
    signal.quantity = unit->quantity;
    signal.value = signal.value.unaryExpr([unit](double v) { return unit->to_si(v); }).eval();
  }
  return signal;
}

void add_signal(SignalFile& file, const SignalTable& like, Signal signal) {
  if (!std::isfinite(like.start) || !std::isfinite(like.step) || like.step < 0) {
    file.findings.push_back(fmt::format("channel '{}': an abscissa from {:g} in steps of {:g} makes no sense",
                                        signal.name, like.start, like.step));
    SignalTable without = like;
    without.start = without.step = 0;
    add_signal(file, without, std::move(signal));
    return;
  }
  for (SignalTable& table : file.tables) {
    if (table.abscissa == like.abscissa && table.name == like.name && table.x.size() == 0 && like.x.size() == 0 &&
        table.rows() == signal.value.size() && std::abs(table.step - like.step) <= 1e-9 * std::abs(like.step) &&
        std::abs(table.start - like.start) <= 1e-3 * std::abs(like.step)) {
      table.signals.push_back(std::move(signal));
      return;
    }
  }
  file.tables.push_back(like);
  file.tables.back().signals = {std::move(signal)};
}

void set_abscissa(SignalTable& table, Quantity quantity, const Eigen::VectorXd& values) {
  table.abscissa = quantity;
  const Eigen::Index n = values.size();
  table.start = n > 0 ? values[0] : 0;
  table.step = n > 1 ? (values[n - 1] - values[0]) / static_cast<double>(n - 1) : 0;
  bool uniform = table.step > 0 && std::isfinite(table.step);
  for (Eigen::Index i = 0; i < n && uniform; ++i) {
    uniform = std::abs(values[i] - table.start - table.step * static_cast<double>(i)) <= 0.05 * table.step;
  }
  if (uniform) return;
  table.step = 0;
  table.x = values;
}

}  // namespace whirl::io
