#include "formats/csv/csv_header.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>

#include "formats/csv/csv_fields.hpp"
#include "formats/text_lines.hpp"
#include "formats/usual_unit.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/names.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::io::detail {
namespace {

/// "Probe 1 [mm]" -> "Probe 1", "mm"; "t / s" -> "t", "s". The label is empty when there is none.
std::pair<std::string_view, std::string_view> instrument_form(std::string_view text) {
  constexpr std::string_view kOpen = "[({", kClose = "])}";
  if (text.empty()) return {text, {}};
  if (const std::size_t kind = kClose.find(text.back()); kind != std::string_view::npos) {
    const std::size_t open = text.rfind(kOpen[kind]);
    if (open == std::string_view::npos) return {text, {}};
    return {trim_of(text.substr(0, open)), trim_of(text.substr(open + 1, text.size() - open - 2))};
  }
  const std::size_t slash = text.rfind(" / ");
  if (slash == std::string_view::npos) return {text, {}};
  return {trim_of(text.substr(0, slash)), trim_of(text.substr(slash + 3))};
}

std::string plain_name(std::string_view text) {
  std::string name = one_line(trim_of(text));
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == ' ' || c == '\t'; }, '_');
  return name;
}

std::string present(const std::vector<Heading>& headings) {
  std::string out;
  for (const Heading& h : headings) out += (out.empty() ? "" : ", ") + shown(h.text);
  return out;
}

bool looks_like_data(const std::string& field) {
  std::string text = field;
  std::replace(text.begin(), text.end(), ',', '.');
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error != std::errc::invalid_argument && end != text.data() && value != 1;  // "1" and "1/s" are units
}

constexpr std::string_view kBetween = " \t_-,;()";

std::string_view without_separators(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBetween);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBetween) + 1 - first);
}

bool is_letter_or_digit(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; }

/// Spellings of the kinds of amplitude; a longer one stands before those that it ends with.
constexpr std::pair<std::string_view, std::string_view> kKinds[] = {
    {"peak-to-peak", "pp"}, {"peak to peak", "pp"}, {"peak_to_peak", "pp"}, {"peaktopeak", "pp"},
    {"peak-peak", "pp"},    {"pk-to-pk", "pp"},     {"pk-pk", "pp"},        {"pk_pk", "pp"},
    {"pk pk", "pp"},        {"pkpk", "pp"},         {"p-p", "pp"},          {"p_p", "pp"},
    {"p2p", "pp"},          {"ptp", "pp"},          {"pp", "pp"},           {"zero-to-peak", "peak"},
    {"zero-peak", "peak"},  {"0-to-peak", "peak"},  {"0-peak", "peak"},     {"0-pk", "peak"},
    {"0-p", "peak"},        {"0p", "peak"},         {"z-p", "peak"},        {"peak", "peak"},
    {"pk", "peak"},         {"rms", "rms"},         {"eff", "rms"}};

/// A unit, perhaps beside a kind of amplitude.
struct StatedUnit {
  const UnitSuffix* unit = nullptr;
  std::string_view kind = {};
};

/// "mils p-p", "RMS mm/s", "umpp": the kind counts only where the rest is a unit.
StatedUnit stated_by(std::string_view label) {
  if (const UnitSuffix* unit = unit_from_label(label)) return {unit, {}};
  const std::string small = small_letters(label);
  for (const auto& [word, kind] : kKinds) {
    for (const bool behind : {true, false}) {
      if (!(behind ? small.ends_with(word) : small.starts_with(word))) continue;
      const std::string_view rest = behind ? label.substr(0, label.size() - word.size()) : label.substr(word.size());
      if (const UnitSuffix* unit = unit_from_label(without_separators(rest))) return {unit, kind};
    }
  }
  return {};
}

/// The kind of amplitude as a word of its own: at the end of a heading, which loses it, or among the words of a name.
std::string_view take_kind(std::string_view& text) {
  const std::string small = small_letters(text);
  for (const auto& [word, kind] : kKinds) {
    const std::size_t at = small.size() - word.size();
    if (!small.ends_with(word) || at == 0 || is_letter_or_digit(small[at - 1])) continue;
    text = text.substr(0, at);
    while (!text.empty() && kBetween.find(text.back()) != std::string_view::npos) text.remove_suffix(1);
    return kind;
  }
  return {};
}
std::string_view kind_in(std::string_view name) {
  while (!name.empty()) {
    if (const std::string_view kind = take_kind(name); !kind.empty()) return kind;
    name = name.substr(0, std::min(name.find_last_of('_'), name.size()));
    if (name.find('_') == std::string_view::npos) break;
  }
  return {};
}

/// What a heading states that has no unit by which it can be read: "X (mils p-p)", "acc_G", "v mm/s rms".
void find_stated(Heading& h) {
  const auto [name, label] = instrument_form(trim_of(h.text));
  if (!label.empty()) {
    const StatedUnit stated = stated_by(label);
    h.base = plain_name(name);
    h.stated = stated.unit;
    h.kind = stated.kind;
    h.unclear = stated.unit == nullptr;
    return;
  }
  std::string_view text = trim_of(h.text);
  h.kind = take_kind(text);
  if (const NameWithUnit split = split_unit(text); split.unit != nullptr && !h.kind.empty()) {
    h.base = plain_name(split.name);
    h.stated = split.unit;
    return;
  }
  const std::size_t last = text.find_last_of(" _");
  if (last == std::string_view::npos || last == 0) return;
  const std::string_view word = text.substr(last + 1);
  const std::string small = small_letters(word), before = small_letters(text.substr(0, last));
  const UnitSuffix* unit = unit_from_label(word);
  const bool number = unit != nullptr && unit->suffix == "1";
  const bool like_one = std::ranges::any_of(
      all_units(), [&](const UnitSuffix& u) { return u.suffix != "1" && small_letters(u.suffix) == small; });
  if (number || (unit == nullptr && !like_one)) return;
  h.base = plain_name(text.substr(0, last));
  // A single letter behind a blank may count the probes: "Probe A".
  if (unit != nullptr && (word.size() > 1 || text[last] == '_' || (small == "g" && before.starts_with("acc"))))
    h.stated = unit;
  else
    h.unclear = true;
}

}  // namespace

std::string shown(std::string_view text) {
  std::string out(text.substr(0, 40));
  for (char& c : out) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return text.size() > 40 ? out + "..." : out;
}

std::string in_utf8(std::string_view raw) {
  const bool ascii = std::all_of(raw.begin(), raw.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; });
  return ascii ? std::string(raw) : text_of(raw);
}

namespace {
Heading heading_of(std::string_view raw) {
  const std::string utf8 = in_utf8(raw);
  const std::string_view text = utf8;
  Heading h{std::string(text), plain_name(text)};
  if (h.text == "rpm") return {h.text, "speed", find_unit("rpm")};
  if (h.text == "hz" || h.text == "Hz") return {h.text, "freq", find_unit("hz")};
  if (const NameWithUnit split = split_unit(text); split.unit != nullptr)
    return {h.text, one_line(split.name), split.unit};
  const auto [name, label] = instrument_form(trim_of(text));
  if (!label.empty()) {
    if (const UnitSuffix* unit = unit_from_label(label)) return {h.text, plain_name(name), unit, true};
  }
  if (const std::size_t last = text.rfind('_'); last != std::string_view::npos && last > 0 && text.size() > last + 2) {
    if (const UnitSuffix* unit = unit_from_label(text.substr(last + 1)))  // "x_inch"
      return {h.text, plain_name(text.substr(0, last)), unit};
  }
  if (text.ends_with("_re") || text.ends_with("_im")) h.unit = &si_suffix(Quantity::dimensionless);
  return h;
}
}  // namespace

Heading parse_heading(std::string_view raw) {
  Heading h = heading_of(raw);
  if (h.unit == nullptr) find_stated(h);
  if (h.unit == nullptr || small_letters(h.name) != "speed") return h;
  // Of a rotor, also where it counts turns a second.
  if (const UnitSuffix* turning = find_unit(h.unit->suffix, Quantity::angular_velocity)) h.unit = turning;
  return h;
}

bool take_units(std::vector<Heading>& headings, const std::vector<std::string>& fields) {
  if (fields.size() != headings.size()) return false;
  bool any = false;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (!fields[i].empty() && looks_like_data(fields[i])) return false;
    any = any || (headings[i].unit == nullptr && stated_by(fields[i]).unit != nullptr);
  }
  if (!any) return false;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (fields[i].empty()) continue;
    const StatedUnit stated = stated_by(fields[i]);
    Heading& h = headings[i];
    if (h.unit != nullptr && h.unit != stated.unit)
      throw Error(fmt::format("column '{}' is in {} by the line below", shown(h.text),
                              stated.unit != nullptr ? stated.unit->suffix : shown(fields[i])));
    h.foreign = true;
    h.kind = stated.kind;
    h.label = fields[i];
    h.base = h.name;
    h.stated = stated.unit;
    h.unclear = stated.unit == nullptr;
    if (stated.kind.empty()) h.unit = stated.unit;
  }
  return true;
}

namespace {

/// "weg_x", "displacement_y": a probe by what it measures and its direction.
bool is_probe(const std::string& name) {
  constexpr std::string_view kWords[] = {"weg",   "disp", "depl", "dplacement", "schwing", "shaft", "welle", "probe",
                                         "sonde", "prox", "gap",  "verschieb",  "auslenk", "spost", "desp",  "sensor"};
  const bool axis = name.ends_with("_x") || name.ends_with("_y");
  return axis && std::ranges::any_of(kWords, [&](std::string_view word) { return name.starts_with(word); }) &&
         name.find('_') == name.size() - 2;
}

/// whirl's name for what a heading may mean.
std::string guessed_name(const Heading& h) {
  std::string name = small_letters(h.base.empty() ? h.name : h.base);
  constexpr std::pair<std::string_view, std::string_view> kWords[] = {
      {"zeit", "t"},          {"time", "t"},         {"winkel", "beta"},
      {"angle", "beta"},      {"drehzahl", "speed"}, {"drehwinkel", "beta"},
      {"kraft", "force"},     {"weg", "x"},          {"beschleunigung", "acc"},
      {"timestamp", "t"},     {"rpm", "speed"},      {"phasor", "key"},
      {"trigger", "key"},     {"tach", "tacho"},     {"zeitstempel", "t"},
      {"temps", "t"},         {"ampl", "amp"},       {"amplitude", "amp"},
      {"1x_ampl", "amp"},     {"1x_amp", "amp"},     {"1x_phase", "phase"},
      {"1x_amplitude", "amp"}};
  for (const auto& [word, known] : kWords)
    if (name == word) return std::string(known);
  std::erase_if(name, [](char c) { return !((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'); });
  if (is_probe(name)) return name.substr(name.size() - 1);
  return name.empty() ? "c" : name;
}

}  // namespace

void use_known_names(std::vector<Heading>& headings, const std::vector<std::string>& required) {
  std::vector<std::string> known;
  for (const std::string& wanted : required) known.emplace_back(split_unit(wanted).name);
  const auto asked = [&](const std::string& name) {
    return std::find(known.begin(), known.end(), name) != known.end();
  };
  for (Heading& h : headings) {
    std::string name = small_letters(h.name);
    if (!asked(name)) name = channel_role(h.name);
    if (name == h.name || asked(h.name)) continue;
    const auto same = [&](const Heading& other) { return &other != &h && small_letters(other.name) == name; };
    if (std::none_of(headings.begin(), headings.end(), same)) h.name = name;
  }
}

namespace {

/// A name that is wanted for this quantity, where none of the headings has it; else `name`.
std::string wanted_name(const std::string& name, std::string_view unit, const std::vector<Heading>& headings,
                        const std::vector<std::string>& required) {
  const UnitSuffix* stated = find_unit(unit);
  for (const std::string& text : required) {
    const NameWithUnit wanted = split_unit(text);
    if (wanted.unit == nullptr || stated == nullptr || wanted.unit->quantity != stated->quantity) continue;
    if (std::ranges::none_of(headings, [&](const Heading& h) { return guessed_name(h) == wanted.name; }))
      return wanted.name;
  }
  return name;
}

}  // namespace

std::string proposed_columns(const std::vector<Heading>& headings, bool numbers,
                             const std::vector<std::string>& required) {
  std::string out;
  std::vector<std::string> taken;
  bool ask = false;
  for (std::size_t i = 0; i < headings.size() && i < 12; ++i) {
    const Heading& h = headings[i];
    std::string name = guessed_name(h);
    const UnitSuffix* known = h.unit != nullptr ? h.unit : h.stated;
    const std::string_view unit = known != nullptr ? known->suffix : h.unclear ? "UNIT" : usual_unit(name);
    ask = ask || (known == nullptr && h.unclear);
    const std::string own = name;
    name = wanted_name(name, unit, headings, required);
    if (name == own && !h.kind.empty() && kind_in(name).empty()) name += fmt::format("_{}", h.kind);
    while (std::find(taken.begin(), taken.end(), name) != taken.end()) name += "b";
    taken.push_back(name);
    std::string spec = fmt::format("{}:{}_{}", numbers ? std::to_string(i + 1) : shown(h.text), name, unit);
    if (spec.find_first_of(" ()[]*;&'$") != std::string::npos) spec = '"' + spec + '"';
    out += (out.empty() ? "" : " ") + spec;
  }
  if (headings.size() > 12) out += " ...";
  return ask ? out + " (write its unit for UNIT)" : out;
}

std::string unit_failure(const std::vector<Heading>& headings, std::size_t column, const std::string& written,
                         const std::vector<std::string>& required) {
  const Heading& h = headings[column];
  std::string problem = "column " + unit_problem(shown(written)), allowed;
  if (const std::size_t list = problem.rfind("; allowed units"); list != std::string::npos) {
    if (written.find('_', 1) != std::string::npos || h.unclear) allowed = problem.substr(list);
    problem.resize(list);
  }
  if (!h.label.empty() && h.unclear) {
    problem = fmt::format("column '{}' has the unknown unit '{}'", shown(h.text), shown(h.label));
  } else if (h.stated != nullptr && !h.kind.empty()) {
    problem = fmt::format("column '{}' states a kind of amplitude beside its unit, {} {}", shown(h.text),
                          h.stated->suffix, h.kind == "pp" ? "peak-to-peak" : h.kind);
  }
  return fmt::format("{}, or name the columns: --columns {}{}", problem, proposed_columns(headings, false, required),
                     allowed);
}

namespace {

/// Refuses a unit stated beside another one that the header states. A factor says how the one follows from the other; a
/// number at the end of a name ("ch_1") is no unit.
void require_unit_of_header(const std::string& spec, const Heading& h, const UnitSuffix& wanted) {
  const UnitSuffix* stated = h.unit != nullptr ? h.unit : h.stated;
  if (stated == nullptr || stated == &wanted || stated->quantity == Quantity::dimensionless) return;
  if (stated->quantity != wanted.quantity)
    throw Error::in_field(
        "--columns", spec,
        fmt::format("{0}*FACTOR: the header says {1}, so FACTOR is the calibration in {2} per {1} (8 {1} per {2}: "
                    "0.125)",
                    spec, stated->suffix, wanted.suffix));
  throw Error::in_field(
      "--columns", spec,
      fmt::format("the unit of the header, which says {}. To read values in {} after a calibration or a wrong header, "
                  "state a factor: {}*1",
                  stated->suffix, wanted.suffix, spec));
}

void require_kind_of_header(const std::string& spec, const Heading& h, std::string_view name) {
  const std::string_view kind = kind_in(name);
  if (h.kind.empty() || kind.empty() || kind == h.kind) return;
  throw Error::in_field("--columns", spec,
                        fmt::format("the amplitude of the header, which says {}. To read {} after a calibration or a "
                                    "wrong header, state a factor: {}*1",
                                    h.kind, kind, spec));
}

}  // namespace

std::string dropped_kind(const Heading& h, const ColumnChoice& choice) {
  if (h.kind.empty() || choice.factor != 1 || kind_in(choice.name) == h.kind) return "";
  return fmt::format("column '{}' is {} by its header; its values are taken as they are for {}", shown(h.text),
                     h.kind == "pp" ? "peak-to-peak" : h.kind, choice.name);
}

ColumnChoice choose_column(const std::string& spec, const std::vector<Heading>& headings) {
  const auto place = [&](std::string_view wanted) {
    for (std::size_t i = 0; i < headings.size(); ++i)
      if (!headings[i].text.empty() && headings[i].text == wanted) return i;
    for (std::size_t i = 0; i < headings.size(); ++i)
      if (headings[i].foreign && (headings[i].name == wanted || instrument_form(headings[i].text).first == wanted))
        return i;
    // A name alone, and headings in other letters, where they mean one column.
    for (const bool names : {true, false}) {
      std::size_t found = headings.size();
      long count = 0;
      for (std::size_t i = 0; i < headings.size(); ++i)
        if (small_letters(names ? headings[i].name : headings[i].text) == small_letters(wanted) && !wanted.empty())
          found = i, ++count;
      if (count == 1) return found;
    }
    return headings.size();
  };
  const std::size_t whole = place(spec), colon = whole < headings.size() ? std::string::npos : spec.rfind(':');
  const std::string from = spec.substr(0, colon);
  std::string to = colon == std::string::npos ? spec : spec.substr(colon + 1);
  ColumnChoice choice;
  choice.heading = place(from);
  if (choice.heading == headings.size()) {
    const std::size_t number = number_of<std::size_t>(from).value_or(0);
    if (number < 1 || number > headings.size()) {
      const bool headless = headings.empty() || headings.front().text.empty();
      throw Error(fmt::format("no column '{}'; {}", from,
                              headless ? fmt::format("the file has no header: write 1 to {}", headings.size())
                                       : "present: " + present(headings)));
    }
    choice.heading = number - 1;
  }
  const Heading& h = headings[choice.heading];
  if (colon == std::string::npos) {
    const Heading own = h.text.empty() ? parse_heading(to) : h;
    choice.name = own.name;
    choice.unit = own.unit;
    return choice;
  }
  const std::size_t star = to.rfind('*');
  if (star != std::string::npos) {
    choice.factor = factor_of(spec);
    to.resize(star);
  }
  const Heading wanted = parse_heading(to);
  choice.name = wanted.name;
  if (wanted.unit != nullptr && star == std::string::npos) require_unit_of_header(spec, h, *wanted.unit);
  if (star == std::string::npos) require_kind_of_header(spec, h, wanted.name);
  const bool readable = h.kind.empty() || kind_in(wanted.name) == h.kind;
  choice.unit = wanted.unit != nullptr ? wanted.unit : h.unit != nullptr || !readable ? h.unit : h.stated;
  if (wanted.unit == nullptr && choice.unit != nullptr && wanted.text.find('_', 1) != std::string::npos)
    choice.unit = nullptr;  // "x_furlong" asks for a unit that is not known
  return choice;
}

}  // namespace whirl::io::detail
