#pragma once
#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace whirl::app {

/// "whirl: KIND: TEXT" on stderr, one line: what a file or an argument brought into the text commands no terminal.
void complain(const char* kind, const std::string& text);

// What a value on the command line must be. A refusal reads "--flag = value: must be ...", like every error of the
// program.
// `several`: the flag takes a list, whose values are separated by spaces.
CLI::Validator finite_number(bool several);
CLI::Validator whole_number(bool negative, bool several);
CLI::Validator between(double low, double high);
CLI::Validator positive_number();
/// Refuses three decimals or more that are a multiple of 15 degrees in radians ("1.5708"). Of angles drawn evenly over
/// a turn and written with three decimals one in 7000 is.
CLI::Validator degrees();
CLI::Validator member(const std::vector<std::string>& choices);
CLI::Validator file_that_exists();

template <class T>
struct NumberOf {
  using type = T;
};
template <class T>
struct NumberOf<std::vector<T>> {
  using type = T;
};
template <class T>
struct NumberOf<std::optional<T>> {
  using type = T;
};

/// Numbers are finite, and whole where the variable is.
template <class T>
void check_number(CLI::Option& option) {
  using Number = typename NumberOf<T>::type;
  constexpr bool several = std::is_same_v<T, std::vector<Number>>;
  if constexpr (std::is_floating_point_v<Number>) option.check(finite_number(several));
  if constexpr (std::is_integral_v<Number>) option.check(whole_number(std::is_signed_v<Number>, several));
}

/// Says that there is no such flag or subcommand, with the nearest name that there is. Returns the exit code.
int say_unknown(const std::string& what, const std::string& word, const std::vector<std::string>& names,
                const CLI::App& app);

/// Says what is wrong with the words given to `app`, in one sentence. Returns the exit code.
int say_misused(const CLI::ParseError& error, const CLI::App& app);

}  // namespace whirl::app
