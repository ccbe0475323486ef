#include "whirl/expr/term_list.hpp"

namespace whirl::expr {
namespace {

std::string strip(const std::string& text) {
  const auto first = text.find_first_not_of(' ');
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(' ') - first + 1);
}

}  // namespace

std::vector<std::string> split_terms(const std::string& list) {
  std::vector<std::string> terms;
  int depth = 0;
  std::string term;
  for (const char c : list + ",") {
    depth += (c == '(') - (c == ')');
    if (c != ',' || depth > 0) {
      term += c;
    } else {
      if (!strip(term).empty()) terms.push_back(strip(term));
      term.clear();
    }
  }
  return terms;
}

}  // namespace whirl::expr
