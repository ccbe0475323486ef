#pragma once
#include <string>
#include <string_view>

/// What may stand in a name that came in a file. Every reader of a schema asks here; JsonReader and Settings say file,
/// field, value and the sentence of the kind.
namespace whirl {

/// A variable of equations: a letter or underscore, then letters, digits and underscores (at most 128 characters), then
/// up to eight primes for derivatives in time.
bool is_identifier(std::string_view name);
inline constexpr std::string_view kIdentifierRule =
    "must be a letter or underscore, then letters, digits and underscores, with primes behind them at most";

/// Left-hand side of an equation: an identifier (x', x''), or one with [k+1] behind it.
bool is_left_side(std::string_view text);
inline constexpr std::string_view kLeftSideRule = "must be a variable with primes (x') or with [k+1] behind it";

/// Name of a channel, a parameter or a method, for people: one line of at most 4096 bytes of UTF-8 without control
/// characters and without what turns the direction of writing.
bool is_label(std::string_view text);
inline constexpr std::string_view kLabelRule = "must be one line of printable UTF-8 text, at most 4096 bytes";

/// Text of a unit: at most 100 bytes of letters (of any alphabet), digits, blanks and ^ . - + % ( ), with * and / not
/// side by side. Empty is allowed.
bool is_unit_text(std::string_view text);
inline constexpr std::string_view kUnitRule = "must be a unit of letters, digits, blanks and ^ * / . - + % ( )";

/// ASCII letters made small; the rest as it is.
std::string small_letters(std::string_view text);

/// The name of a channel: in small letters where it then is the time, the motion, the angle, pulses or the speed of a
/// rotor ("Keyphasor", "BETA"), else as it is.
std::string channel_role(std::string_view name);

/// Any text as one line that `is_label` allows, whatever its length: what it does not allow becomes a blank, bytes that
/// are no UTF-8 a question mark.
std::string one_line(std::string_view text);

}  // namespace whirl
