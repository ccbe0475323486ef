#include "formats/csv/csv_header.hpp"

#include <fmt/format.h>

#include <algorithm>
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
    any = any || (headings[i].unit == nullptr && unit_from_label(fields[i]) != nullptr);
  }
  if (!any) return false;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    if (fields[i].empty()) continue;
    const UnitSuffix* unit = unit_from_label(fields[i]);
    Heading& h = headings[i];
    if (unit == nullptr)
      throw Error(fmt::format("column '{}' has the unknown unit '{}'; allowed units: {}", shown(h.text),
                              shown(fields[i]), allowed_units()));
    if (h.unit != nullptr && h.unit != unit)
      throw Error(fmt::format("column '{}' is in {} by the line below", shown(h.text), unit->suffix));
    h.unit = unit;
    h.foreign = true;
  }
  return true;
}

namespace {

/// whirl's name for what a heading may mean.
std::string guessed_name(const Heading& h) {
  std::string name = small_letters(h.name);
  constexpr std::pair<std::string_view, std::string_view> kWords[] = {
      {"zeit", "t"},          {"time", "t"},      {"winkel", "beta"}, {"angle", "beta"},         {"drehzahl", "speed"},
      {"drehwinkel", "beta"}, {"kraft", "force"}, {"weg", "x"},       {"beschleunigung", "acc"}, {"timestamp", "t"},
      {"rpm", "speed"},       {"phasor", "key"},  {"trigger", "key"}, {"tach", "tacho"}};
  for (const auto& [word, known] : kWords)
    if (name == word) return std::string(known);
  std::erase_if(name, [](char c) { return !((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_'); });
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
  for (std::size_t i = 0; i < headings.size() && i < 12; ++i) {
    const Heading& h = headings[i];
    std::string name = guessed_name(h);
    const std::string_view unit = h.unit != nullptr ? h.unit->suffix : usual_unit(name);
    name = wanted_name(name, unit, headings, required);
    while (std::find(taken.begin(), taken.end(), name) != taken.end()) name += "b";
    taken.push_back(name);
    std::string spec = fmt::format("{}:{}_{}", numbers ? std::to_string(i + 1) : shown(h.text), name, unit);
    if (spec.find_first_of(" ()[]*;&'$") != std::string::npos) spec = '"' + spec + '"';
    out += (out.empty() ? "" : " ") + spec;
  }
  return headings.size() > 12 ? out + " ..." : out;
}

namespace {

/// Refuses a unit stated beside another one that the header states. A factor says how the one follows from the other; a
/// number at the end of a name ("ch_1") is no unit.
void require_unit_of_header(const std::string& spec, const Heading& h, const UnitSuffix& wanted) {
  if (h.unit == nullptr || h.unit == &wanted || h.unit->quantity == Quantity::dimensionless) return;
  if (h.unit->quantity != wanted.quantity)
    throw Error::in_field(
        "--columns", spec,
        fmt::format("{0}*FACTOR: the header says {1}, so FACTOR is the calibration in {2} per {1} (8 {1} per {2}: "
                    "0.125)",
                    spec, h.unit->suffix, wanted.suffix));
  throw Error::in_field(
      "--columns", spec,
      fmt::format("the unit of the header, which says {}. To read values in {} after a calibration or a wrong header, "
                  "state a factor: {}*1",
                  h.unit->suffix, wanted.suffix, spec));
}

}  // namespace

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
  choice.unit = wanted.unit != nullptr ? wanted.unit : h.unit;
  if (wanted.unit == nullptr && choice.unit != nullptr && wanted.text.find('_', 1) != std::string::npos)
    choice.unit = nullptr;  // "x_furlong" asks for a unit that is not known
  return choice;
}

}  // namespace whirl::io::detail
