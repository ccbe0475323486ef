#include "whirl/io/signals.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "formats/format.hpp"
#include "formats/parts/rows.hpp"
#include "formats/text_lines.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/names.hpp"
#include "whirl/io/remarks.hpp"

namespace whirl::io {
namespace {

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
    choice.factor = factor_of(text);
    wanted.resize(star);
  }
  const NameWithUnit split = split_unit(wanted);
  choice.name = split.unit != nullptr ? split.name : wanted;
  choice.header = colon == std::string::npos ? choice.name : text.substr(0, colon);
  choice.unit = split.unit;
  // "3:+X:x" keeps the unit of the file; "x_furlong" asks for one that is not known.
  if (colon != std::string::npos && split.unit == nullptr && wanted.find('_', 1) != std::string::npos)
    throw Error(unit_problem(wanted));
  if (choice.factor != 1 && split.unit == nullptr) throw Error::in_field("--columns", text, "HEADER:name_unit*FACTOR");
  return choice;
}

struct TimeChannel {
  const Signal* signal;
  const SignalTable* table;
};

struct Chosen {
  TimeChannel channel;
  Choice choice;
};

Error failure(const SignalFile& file, const std::string& message) { return Error::in_file(file.source, 0, message); }

/// Real channels over time, in the order of the file.
std::vector<TimeChannel> channels_over_time(const SignalFile& file) {
  std::vector<TimeChannel> found;
  for (const SignalTable& table : file.tables) {
    for (const Signal& signal : table.signals) {
      if (signal.imaginary.size() > 0 || (table.abscissa && *table.abscissa != Quantity::time)) continue;
      if (signal.quantity == Quantity::time && signal.name == "t") continue;
      found.push_back({&signal, &table});
    }
  }
  if (found.empty()) {
    std::string there;
    for (const auto* list : {&file.findings, &file.contents}) {
      for (const std::string& text : *list)
        if (there.size() < 160) there += (there.empty() ? "; it holds " : "; ") + text;
    }
    throw failure(file, fmt::format("{} without a channel over time{}", file.format, there));
  }
  return found;
}

/// Place of a channel by its name or, where no name fits, by its number from 1.
std::size_t place_of(const std::string& wanted, const std::vector<TimeChannel>& all, const SignalFile& file) {
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].signal->name == wanted) return i;
  }
  const std::size_t number = number_of<std::size_t>(wanted).value_or(0);
  if (number >= 1 && number <= all.size()) return number - 1;
  std::string present;
  for (const TimeChannel& c : all) present += (present.empty() ? "" : ", ") + c.signal->name;
  throw failure(file, fmt::format("no channel '{}'; present: {}", wanted, present));
}

std::vector<Chosen> choose(const SignalFile& file, const std::vector<std::string>& columns) {
  const std::vector<TimeChannel> all = channels_over_time(file);
  std::vector<Chosen> chosen;
  if (columns.empty()) {
    for (const TimeChannel& c : all) chosen.push_back({c, {c.signal->name, c.signal->name}});
    return chosen;
  }
  std::vector<const Signal*> signals;
  for (const TimeChannel& c : all) signals.push_back(c.signal);
  for (const std::string& text : columns) {
    Choice choice = parse_choice(text, signals);
    const std::size_t place = place_of(choice.header, all, file);
    chosen.push_back({all[place], std::move(choice)});
  }
  return chosen;
}

/// Time between samples: of the file, or of the rate given, which may not contradict it.
double step_of(const TimeChannel& channel, const std::optional<double>& rate, const SignalFile& file) {
  const std::string& name = channel.signal->name;
  const double step = channel.table->step;
  if (channel.table->x.size() > 0) throw failure(file, fmt::format("channel '{}': its times are not uniform", name));
  if (rate) {
    require_range("rate", *rate, 1e-9, 1e12, "Hz");
    if (step > 0 && std::abs(*rate * step - 1) > 1e-3) {
      throw failure(file,
                    fmt::format("the rate given is {} Hz, but channel '{}' has {:.9g} Hz", *rate, name, 1 / step));
    }
    return 1 / *rate;
  }
  if (!(step > 0)) {
    throw failure(file, fmt::format("channel '{}' states no times: state the sample rate (--rate, Hz)", name));
  }
  return step;
}

/// Values in SI and their quantity, by the file's unit or the one chosen.
std::pair<Quantity, Eigen::VectorXd> in_si(const Chosen& chosen, const SignalFile& file) {
  const Signal& signal = *chosen.channel.signal;
  const UnitSuffix* const unit = chosen.choice.unit;
  if (unit != nullptr && !signal.quantity) {
    return {unit->quantity, signal.value.unaryExpr([&](double v) { return unit->to_si(chosen.choice.factor * v); })};
  }
  // The file's values are in its unit: another one contradicts it, as does a factor.
  const UnitSuffix* const stated = unit_from_label(signal.unit);
  const bool other = stated != nullptr && unit != nullptr && stated->quantity == unit->quantity &&
                     std::abs(stated->to_si(1) - unit->to_si(1)) > 1e-9 * std::abs(unit->to_si(1));
  if (unit != nullptr && (*signal.quantity != unit->quantity || chosen.choice.factor != 1 || other)) {
    throw failure(file, fmt::format("channel '{}' is in {} by the file: it cannot be taken in {}", signal.name,
                                    signal.unit, unit->suffix));
  }
  if (!signal.quantity) {
    throw failure(file,
                  fmt::format("channel '{}' has {}: state it with --columns '{}:name_unit' (units: {})", signal.name,
                              signal.unit.empty() ? "no unit" : fmt::format("the unknown unit '{}'", signal.unit),
                              signal.name, allowed_units()));
  }
  return {*signal.quantity, signal.value};
}

void require_channels(const Recording& recording, const std::vector<std::string>& required) {
  for (const std::string& text : required) {
    const NameWithUnit split = split_unit(text);
    const Channel& channel = recording.at(split.unit != nullptr ? split.name : text);
    if (split.unit != nullptr && channel.quantity != split.unit->quantity)
      throw Error::in_file(recording.source, 0, quantity_problem(channel.name, channel.quantity, split.unit->quantity));
  }
}

}  // namespace

void check_with_gaps(const Recording& recording) {
  if (std::ranges::none_of(recording.channels, [](const Channel& c) { return c.samples.hasNaN(); }))
    return recording.check();
  Recording filled = recording;
  for (Channel& c : filled.channels) c.samples = c.samples.array().isNaN().select(0.0, c.samples);
  filled.check();
}

Recording recording_of(const SignalFile& file, const CsvOptions& options) {
  for (const std::string& finding : file.findings) remark(file.source, finding);
  const std::vector<Chosen> chosen = choose(file, options.columns);
  Recording recording;
  recording.source = file.source;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    const auto& [channel, choice] = chosen[i];
    const double step = step_of(channel, options.rate, file);
    const Signal& signal = *channel.signal;
    const double start = channel.table->start;
    if (i == 0) {
      recording.dt = step;
      recording.t0 = start;
    } else if (std::abs(step - recording.dt) > 1e-6 * recording.dt || signal.value.size() != recording.size() ||
               std::abs(start - recording.t0) > 0.05 * recording.dt) {
      throw failure(
          file,
          fmt::format("channel '{}' has other times ({} samples at {:g} Hz) than '{}': choose channels with --columns",
                      signal.name, signal.value.size(), 1 / step, recording.channels.front().name));
    }
    auto [quantity, value] = in_si(chosen[i], file);
    std::string name = channel_role(choice.name);
    if (name.empty() || recording.has(name)) name += fmt::format("#{}", i + 1);
    recording.add(std::move(name), quantity, std::move(value));
  }
  require_channels(recording, options.required);
  if (recording.size() < options.min_samples) {
    throw failure(file,
                  fmt::format("{}; at least {} are needed", counted(recording.size(), "sample"), options.min_samples));
  }
  if (options.gaps)
    check_with_gaps(recording);
  else
    recording.check();
  return recording;
}

Recording read_recording(const std::filesystem::path& path, const CsvOptions& options) {
  return file_format(path) == FileFormat::csv ? read_csv(path, options)
                                              : recording_of(read_signals(path, options), options);
}

namespace {

using Spelling = std::pair<std::string_view, std::string_view>;  // from, to

/// Signs of a label as suffixes have them, in this order.
constexpr Spelling kSigns[] = {{"\xC2\xB2", "2"}, {"\xC2\xB3", "3"},   {"\xC2\xB9", "1"}, {"\xE2\x81\xBB", "-"},
                               {"\xC2\xB5", "u"}, {"\xCE\xBC", "u"},   {"**", ""},        {"^", ""},
                               {"(", ""},         {")", ""},           {"[", ""},         {"]", ""},
                               {"\xC2\xB7", "*"}, {"\xC2\xB0", "deg"}, {" ", ""},         {"/", "_"},
                               {"_sec", "_s"}};
/// Words for a unit, after that.
constexpr Spelling kUnitWords[] = {
    {"sec", "s"},         {"second", "s"},       {"Second", "s"},    {"seconds", "s"},      {"Seconds", "s"},
    {"msec", "ms"},       {"usec", "us"},        {"mils", "mil"},    {"Mil", "mil"},        {"Mils", "mil"},
    {"MIL", "mil"},       {"MILS", "mil"},       {"thou", "mil"},    {"milli-inch", "mil"}, {"milliinch", "mil"},
    {"inch", "in"},       {"inches", "in"},      {"inch_s", "in_s"}, {"ips", "in_s"},       {"IPS", "in_s"},
    {"mum", "um"},        {"micron", "um"},      {"microns", "um"},  {"micrometer", "um"},  {"micrometers", "um"},
    {"micrometre", "um"}, {"micrometres", "um"}, {"degree", "deg"},  {"degrees", "deg"},    {"Degrees", "deg"},
    {"radian", "rad"},    {"radians", "rad"},    {"1_min", "rpm"},   {"U_min", "rpm"},      {"rev_min", "rpm"},
    {"r_min", "rpm"},     {"tr_min", "rpm"},     {"min-1", "rpm"},   {"s-1", "1_s"},        {"m_s_s", "m_s2"},
    {"ms-2", "m_s2"},     {"m*s-2", "m_s2"},     {"ms-1", "m_s"},    {"m*s-1", "m_s"},      {"mms-1", "mm_s"},
    {"mm*s-1", "mm_s"},   {"N*m", "Nm"},         {"N.m", "Nm"},      {"HZ", "Hz"},          {"Hertz", "Hz"},
    {"hertz", "Hz"},      {"cps", "Hz"},         {"G", "g"},         {"gs", "g"},           {"g's", "g"},
    {"volt", "V"},        {"Volt", "V"},         {"volts", "V"},     {"Volts", "V"},        {"newton", "N"},
    {"Newton", "N"},      {"newtons", "N"},      {"Newtons", "N"},   {"RPM", "rpm"},        {"-", "1"},
    {"%", "percent"}};

}  // namespace

const UnitSuffix* unit_from_label(std::string_view label) {
  std::string text(label);
  for (const auto& [from, to] : kSigns) {
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
      text.replace(at, from.size(), to);
    }
  }
  for (const auto& [word, suffix] : kUnitWords) {
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

void set_abscissa(SignalTable& table, Quantity quantity, const Eigen::VectorXd& values, const PartOfAxis& part) {
  table.abscissa = quantity;
  const Eigen::Index n = part.rows;
  table.start = n > 0 ? part.head : 0;
  table.step = n > 1 ? (part.tail - part.head) / static_cast<double>(n - 1) : 0;
  bool uniform = table.step > 0 && std::isfinite(table.step);
  for (Eigen::Index i = 0; i < values.size() && uniform; ++i) {
    const double due = table.step * static_cast<double>(part.first + i);
    uniform = std::abs(values[i] - table.start - due) <= 0.05 * table.step;
  }
  if (uniform) return;
  table.step = 0;
  table.x = values;
}

void set_abscissa(SignalTable& table, Quantity quantity, const Eigen::VectorXd& values) {
  const Eigen::Index n = values.size();
  set_abscissa(table, quantity, values, {0, n, n > 0 ? values[0] : 0, n > 0 ? values[n - 1] : 0});
}

}  // namespace whirl::io
