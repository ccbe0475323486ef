// What the program says to a command line that it cannot follow.
#include "usage.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <numbers>

#include "whirl/core/names.hpp"
#include "whirl/core/tell.hpp"
#include "whirl/io/units.hpp"

namespace whirl::app {
namespace {

// CLI11 puts "NAME: " in front; `say_misused` takes the colon away again.
std::string refused(const std::string& value, const std::string& allowed) {
  return fmt::format("= {}: must be {}", value.empty() ? "''" : value, allowed);
}

/// The number that `text` is as a whole.
std::optional<double> number_in(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != 0) return std::nullopt;
  return value;
}

/// What hides a number from the program: a unit behind it, or a comma (30,80 would be read in two ways).
std::string hint(const std::string& text, bool several) {
  char* end = nullptr;
  std::strtod(text.c_str(), &end);
  const std::string rest = end;
  if (rest == text || rest.empty()) return "";
  if (rest[0] == ',')
    return fmt::format(", with a point before its decimals{}", several ? "; several are separated by spaces" : "");
  if (rest[0] == '%')
    return ", without %: a share as in 0.1; 10 % above 1500 is 1650, and 1.1 where the flag is a factor";
  if (std::isalpha(static_cast<unsigned char>(rest[0])) != 0 || rest[0] == ' ')
    return ", without a unit: the flag's name or its help states it";
  return "";
}

std::string call_of(const CLI::App& app) {
  std::string call = app.get_name();
  for (const CLI::App* up = app.get_parent(); up != nullptr; up = up->get_parent()) call = up->get_name() + " " + call;
  return call;
}

int say(const std::string& what, const CLI::App& app, bool help) {
  complain("error", what + (help ? "; see " + call_of(app) + " --help" : ""));
  return 2;
}

}  // namespace

void complain(const char* kind, const std::string& text) { tell("whirl: {}: {}\n", kind, one_line(text)); }

CLI::Validator finite_number(bool several) {
  return {[several](std::string& text) {
            const auto value = number_in(text);
            return value && std::isfinite(*value) ? "" : refused(text, "a finite number" + hint(text, several));
          },
          ""};
}

CLI::Validator whole_number(bool negative, bool several) {
  return {[negative, several](std::string& text) -> std::string {
            char* end = nullptr;
            errno = 0;
            const long long value = std::strtoll(text.c_str(), &end, 10);
            if (*end == ',')
              return refused(text, several ? "a whole number; several are separated by spaces"
                                           : "a whole number, without a comma (1,000 is 1000)");
            if (text.empty() || *end != 0)
              return refused(text, "a whole number" + (number_in(text) ? "" : hint(text, several)));
            if (!negative && value < 0) return refused(text, "a whole number, not below 0");
            return errno == ERANGE ? refused(text, "a smaller number") : "";
          },
          ""};
}

CLI::Validator between(double low, double high) {
  return {[low, high](std::string& text) {
            const auto value = number_in(text);
            const bool percent = value && high <= 1 && *value > 1 && *value <= 100;
            return value && *value >= low && *value <= high
                       ? ""
                       : refused(text, fmt::format("between {:g} and {:g}{}", low, high,
                                                   percent ? fmt::format(": {0:g} % is {1:g}", *value, *value / 100)
                                                           : std::string()));
          },
          high <= 1e5 ? fmt::format("[{:g} to {:g}]", low, high) : ""};  // wider ones only keep nonsense out
}

CLI::Validator degrees() {
  return {[](std::string& text) -> std::string {
            constexpr double kStep = 15;  // deg: what angles are mostly stated in
            const auto value = number_in(text);
            const std::size_t point = text.find('.');
            if (!value || point == std::string::npos || text.size() < point + 4 || std::abs(*value) > 6.3) return "";
            const double said = *value * 180 / std::numbers::pi, whole = kStep * std::round(said / kStep);
            const double digits = std::pow(10.0, -static_cast<double>(text.size() - point - 1));
            if (whole == 0 || std::abs(*value - whole * std::numbers::pi / 180) > digits) return "";
            return refused(text, fmt::format("in degrees: {} rad is {:g} deg", text, whole));
          },
          ""};
}

CLI::Validator positive_number() {
  return {[](std::string& text) {
            const auto value = number_in(text);
            return value && *value > 0 ? "" : refused(text, "above 0");
          },
          "[above 0]"};
}

CLI::Validator member(const std::vector<std::string>& choices) {
  return {[choices](std::string& text) {
            if (std::find(choices.begin(), choices.end(), text) != choices.end()) return std::string();
            const std::string near = io::nearest(text, choices);
            return refused(text, fmt::format("one of {}{}", fmt::join(choices, ", "),
                                             near.empty() ? "" : "; did you mean '" + near + "'?"));
          },
          fmt::format("{{{}}}", fmt::join(choices, ","))};
}

CLI::Validator file_that_exists() {
  return {[](std::string& path) -> std::string {
            std::error_code ec;
            if (std::filesystem::is_directory(path, ec)) return refused(path, "a file: this is a folder");
            return std::filesystem::exists(path, ec) ? "" : refused(path, "a file that is there");
          },
          ""};
}

int say_unknown(const std::string& what, const std::string& word, const std::vector<std::string>& names,
                const CLI::App& app) {
  std::error_code ec;
  if (what == "subcommand" && std::filesystem::is_regular_file(word, ec))
    return say(fmt::format("'{}' is a file, not a command; what it holds: whirl info {}", word, word), app, false);
  const std::string near = io::nearest(word, names);
  return near.empty() ? say(fmt::format("no {} '{}'", what, word), app, true)
                      : say(fmt::format("no {} '{}', did you mean '{}'?", what, word, near), app, false);
}

int say_misused(const CLI::ParseError& error, const CLI::App& app) {
  std::string text = error.what();
  while (!text.empty() && (text.back() == '\n' || text.back() == '.')) text.pop_back();
  const std::string name = text.substr(0, text.find_first_of(": "));
  if (dynamic_cast<const CLI::ValidationError*>(&error) != nullptr) {
    if (const std::size_t at = text.find(": = "); at != std::string::npos) text.erase(at, 1);
    return say(text, app, false);
  }
  if (const auto* required = dynamic_cast<const CLI::RequiredError*>(&error); required != nullptr) {
    const std::size_t at = text.find(" is required");
    return say(at == std::string::npos ? text : text.substr(0, at) + " is missing", app, true);
  }
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr && text.find("At Most 1") != std::string::npos)
    return say(name + ": given more than once", app, true);
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error) != nullptr && text.find("missing") != std::string::npos)
    return say(name + ": its value is missing", app, true);
  if (dynamic_cast<const CLI::ExcludesError*>(&error) != nullptr) {
    const std::size_t at = text.find(" excludes ");
    if (at != std::string::npos)
      return say(fmt::format("{} and {}: give one of them", text.substr(0, at), text.substr(at + 10)), app, false);
  }
  if (const auto* extras = dynamic_cast<const CLI::ExtrasError*>(&error); extras != nullptr) {
    const std::size_t at = text.find(": ");
    if (at != std::string::npos) return say("not expected: " + text.substr(at + 2), app, true);
  }
  return say(text, app, true);
}

}  // namespace whirl::app
