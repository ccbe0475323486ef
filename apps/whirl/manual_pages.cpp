// Manual pages and the reference from the description of a command.
#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "command_texts.hpp"

namespace whirl::app {
namespace {

/// Text as man(7) takes it: no macro at the start of a line, hyphens that can be copied.
std::string roff(const std::string& text) {
  std::string out;
  bool start = true;
  for (const char c : text) {
    if (start && (c == '.' || c == '\'')) out += "\\&";
    if (c == '\\') {
      out += "\\e";
    } else if (c == '-') {
      out += "\\-";
    } else {
      out += c;
    }
    start = c == '\n';
  }
  return out;
}

struct Details {
  std::string text, examples;
};

/// Texts end with their examples.
Details split(const std::string& details) {
  const std::size_t at = details.starts_with("Example") ? 0 : details.find("\nExample");
  if (at == std::string::npos) return {details, ""};
  std::string examples = details.substr(at + (at > 0 ? 1 : 0));
  examples.erase(0, std::min(examples.find(':') + 1, examples.size()));
  return {details.substr(0, at), examples};
}

std::string trim(const std::string& line) {
  const std::size_t first = line.find_first_not_of(' ');
  return first == std::string::npos ? "" : line.substr(first);
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

/// "Output: ..." starts a paragraph; other lines run on.
bool starts_paragraph(const std::string& line) {
  const std::size_t colon = line.find(':');
  return !line.empty() && colon != std::string::npos && colon < 40 && colon + 1 < line.size() &&
         line[colon + 1] == ' ' && line.find(". ") > colon && std::isupper(static_cast<unsigned char>(line[0])) != 0;
}

std::string synopsis(const CommandText& command) {
  std::string text;
  if (!command.children.empty()) text += " SUBCOMMAND";
  text += " [OPTIONS]";
  for (const OptionText& o : command.options) {
    if (!o.positional) continue;
    const std::string name = o.flags.front() + (o.several ? "..." : "");
    text += o.required ? " " + name : " [" + name + "]";
  }
  return text;
}

std::vector<std::string> headings(const CommandText& command) {
  std::vector<std::string> found;
  for (const OptionText& o : command.options) {
    if (!o.positional && std::find(found.begin(), found.end(), o.heading) == found.end()) found.push_back(o.heading);
  }
  return found;
}

std::string flags_of(const OptionText& option) { return fmt::format("{}", fmt::join(option.flags, ", ")); }

std::string allowed(const OptionText& option) {
  return option.choices.empty() ? "" : fmt::format("one of {}", fmt::join(option.choices, ", "));
}

void write_option(std::string& page, const OptionText& option) {
  page += ".TP\n\\fB" + roff(flags_of(option)) + "\\fR";
  if (!option.argument.empty() && !option.positional) page += " \\fI" + roff(option.argument) + "\\fR";
  page += "\n";
  std::string help = option.help.empty() ? allowed(option) : option.help;
  page += roff(help.empty() ? "no further text" : help) + "\n";
}

}  // namespace

std::string page_name(const CommandText& command) {
  std::string name = command.name;
  std::replace(name.begin(), name.end(), ' ', '-');
  return name;
}

std::string manual_page(const CommandText& command, const std::string& version) {
  std::string title = page_name(command);
  std::transform(title.begin(), title.end(), title.begin(), [](unsigned char c) { return std::toupper(c); });
  std::string page = fmt::format(".TH {} 1 \"\" \"whirl {}\" \"whirl\"\n", roff(title), version);
  page += fmt::format(".SH NAME\n{} \\- {}\n", roff(page_name(command)), roff(command.summary));
  page += fmt::format(".SH SYNOPSIS\n.B {}\n{}\n", roff(command.name), roff(trim(synopsis(command))));
  const Details details = split(command.details);
  if (!details.text.empty()) {
    page += ".SH DESCRIPTION\n";
    for (const std::string& line : lines_of(details.text)) {
      if (line.empty()) {
        page += ".PP\n";
        continue;
      }
      if (starts_paragraph(line)) page += ".PP\n";
      page += roff(trim(line)) + "\n";
    }
  }
  if (!command.children.empty()) {
    page += ".SH SUBCOMMANDS\n";
    for (const CommandText& child : command.children)
      page += fmt::format(".TP\n\\fB{}\\fR(1)\n{}\n", roff(page_name(child)), roff(child.summary));
  }
  bool arguments = false;
  for (const OptionText& option : command.options) {
    if (!option.positional) continue;
    if (!arguments) page += ".SH ARGUMENTS\n";
    arguments = true;
    write_option(page, option);
  }
  page += ".SH OPTIONS\n";
  for (const std::string& heading : headings(command)) {
    if (!heading.empty() && heading != "Options") page += ".SS " + roff(heading) + "\n";
    for (const OptionText& option : command.options) {
      if (!option.positional && option.heading == heading) write_option(page, option);
    }
  }
  if (!details.examples.empty()) {
    page += ".SH EXAMPLES\n.nf\n";
    for (const std::string& line : lines_of(details.examples)) page += roff(trim(line)) + "\n";
    page += ".fi\n";
  }
  page +=
      ".SH EXIT STATUS\n0 done; 1 the numbers are not usable (the reason is printed); 2 bad usage or bad input.\n"
      ".SH SEE ALSO\n";
  if (command.name != "whirl") page += ".BR whirl (1),\n";
  return page + "the documentation in /usr/share/doc/whirl\\-doc/html where it is installed\n";
}

std::string markdown_page(const CommandText& command) {
  std::string page =
      fmt::format("## {}\n\n{}.\n\n    {}{}\n\n", command.name, command.summary, command.name, synopsis(command));
  const Details details = split(command.details);
  for (const std::string& line : lines_of(details.text)) {
    if (starts_paragraph(line)) page += "\n";
    std::string escaped;
    for (const char c : trim(line)) {
      if (c == '<' || c == '*' || c == '_' || c == '|') escaped += '\\';
      escaped += c;
    }
    page += escaped + "\n";
  }
  if (!command.options.empty()) page += "\n| argument | meaning |\n| --- | --- |\n";
  for (const OptionText& option : command.options) {
    std::string help = option.help.empty() ? allowed(option) : option.help;
    std::string cell;
    for (const char c : help) {
      if (c == '|' || c == '*' || c == '<') cell += '\\';
      cell += c == '\n' ? ' ' : c;
    }
    const std::string argument = option.positional || option.argument.empty() ? "" : " " + option.argument;
    page += fmt::format("| `{}{}` | {} |\n", flags_of(option), argument, cell);
  }
  if (!details.examples.empty()) {
    page += "\n";
    for (const std::string& line : lines_of(details.examples)) page += "    " + trim(line) + "\n";
  }
  return page + "\n";
}

}  // namespace whirl::app
