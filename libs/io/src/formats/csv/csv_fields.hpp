#pragma once
#include <string_view>
#include <vector>

namespace whirl::io::detail {

/// Without `what` at both ends.
std::string_view trim_of(std::string_view text, std::string_view what = " \t");
std::string_view unquote(std::string_view text);
/// Splits at the delimiter outside of quotes.
std::vector<std::string_view> split(std::string_view line, char delimiter);

enum class Parsed { good, bad, not_finite };
Parsed parse_number(std::string_view text, double& value);
/// What loggers write where there is no value.
bool is_missing(std::string_view text);
/// A number with a decimal point or comma.
bool is_number(std::string_view text);
/// The delimiter of a header line. Blanks, where as many words stand in the header as numbers in the line of `ahead`.
char delimiter_of(std::string_view header, std::string_view ahead);

}  // namespace whirl::io::detail
