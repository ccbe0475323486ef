#include "whirl/report/document.hpp"

#include <fmt/format.h>

#include "document_script.hpp"
#include "document_style.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/output.hpp"

namespace whirl::report {
namespace {

std::string_view kind_name(Callout::Kind kind) {
  switch (kind) {
    case Callout::Kind::agrees:
      return "Agrees";
    case Callout::Kind::disagrees:
      return "Does not agree";
    case Callout::Kind::warning:
      return "Warning";
    case Callout::Kind::note:
      break;
  }
  return "Note";
}

std::string_view kind_class(Callout::Kind kind) {
  switch (kind) {
    case Callout::Kind::agrees:
      return "good";
    case Callout::Kind::disagrees:
      return "bad";
    case Callout::Kind::warning:
      return "warn";
    case Callout::Kind::note:
      break;
  }
  return "info";
}

/// "sha256:" digests are long: the text keeps them whole, so that they can be compared.
std::vector<std::pair<std::string, std::string>> items_of(const Provenance& provenance) {
  std::vector<std::pair<std::string, std::string>> items;
  if (!provenance.version.empty()) items.emplace_back("whirl version", provenance.version);
  for (const std::string& input : provenance.inputs) items.emplace_back("input", input);
  if (!provenance.options.empty()) items.emplace_back("options", provenance.options);
  if (provenance.seed != 0) items.emplace_back("seed", std::to_string(provenance.seed));
  return items;
}

std::string definition_list(const std::vector<std::pair<std::string, std::string>>& items, std::string_view css) {
  std::string out = fmt::format("<dl class=\"{}\">\n", css);
  for (const auto& [name, value] : items) {
    out += fmt::format("<dt>{}</dt><dd>{}</dd>\n", escape_markup(name), escape_markup(value));
  }
  return out + "</dl>\n";
}

class HtmlWriter {
 public:
  std::string take() { return std::move(out_); }

  void operator()(const Heading& h) {
    const int level = h.level <= 2 ? 2 : 3;
    out_ += fmt::format("<h{0} id=\"s{1}\">{2}</h{0}>\n", level, ++headings_, escape_markup(h.text));
  }
  void operator()(const Paragraph& p) { out_ += "<p>" + escape_markup(p.text) + "</p>\n"; }
  void operator()(const BulletList& list) {
    out_ += "<ul>\n";
    for (const std::string& item : list.items) out_ += "<li>" + escape_markup(item) + "</li>\n";
    out_ += "</ul>\n";
  }
  void operator()(const FigureBlock& block) {
    out_ += fmt::format(
        "<figure>\n<div class=\"drawing\">{}</div>\n<figcaption><b>Figure {}.</b> {}</figcaption>\n</figure>\n",
        to_svg(block.figure, {.embedded = true}), ++figures_, escape_markup(block.caption));
  }
  void operator()(const Table& table) {
    Table numbered = table;
    numbered.caption = fmt::format("Table {}. {}", ++tables_, table.caption);
    out_ += "<div class=\"table\">\n" + to_html(numbered) + "</div>\n";
  }
  void operator()(const EquationBlock& block) {
    for (const Equation& equation : block.equations) {
      out_ += fmt::format("<div class=\"equation\">{}<span class=\"number\">({})</span></div>\n",
                          to_mathml(equation, block.names), ++equations_);
    }
    out_ += "<details><summary>LaTeX</summary><pre><code>\\begin{aligned}\n";
    for (const Equation& equation : block.equations) out_ += escape_markup(to_latex(equation, block.names)) + " \\\\\n";
    out_ += "\\end{aligned}</code></pre></details>\n";
  }
  void operator()(const KeyValues& block) { out_ += definition_list(block.items, "values"); }
  void operator()(const Callout& c) {
    out_ +=
        fmt::format("<aside class=\"{}\"><b>{}: {}</b>", kind_class(c.kind), kind_name(c.kind), escape_markup(c.title));
    if (!c.text.empty()) out_ += "<p>" + escape_markup(c.text) + "</p>";
    out_ += "</aside>\n";
  }
  void operator()(const Code& code) { out_ += "<pre><code>" + escape_markup(code.text) + "</code></pre>\n"; }
  void operator()(const Provenance& p) { out_ += definition_list(items_of(p), "values provenance"); }

 private:
  std::string out_;
  int headings_ = 0, figures_ = 0, tables_ = 0, equations_ = 0;
};

std::string contents(const Document& document) {
  std::string out;
  int number = 0, depth = 0;
  for (const Block& block : document.blocks) {
    const auto* h = std::get_if<Heading>(&block);
    if (h == nullptr) continue;
    const int wanted = h->level <= 2 || depth == 0 ? 1 : 2;
    if (wanted > depth) out += depth == 0 ? "<ol>\n" : "\n<ol>\n";
    if (wanted == depth) out += "</li>\n";
    if (wanted < depth) out += "</li>\n</ol></li>\n";
    out += fmt::format("<li><a href=\"#s{}\">{}</a>", ++number, escape_markup(h->text));
    depth = wanted;
  }
  if (number < 2) return {};
  out += depth == 2 ? "</li>\n</ol></li>\n</ol>\n" : "</li>\n</ol>\n";
  return "<nav aria-label=\"Contents\"><b>Contents</b>\n" + out + "</nav>\n";
}

class TextWriter {
 public:
  std::string take() { return std::move(out_); }

  void operator()(const Heading& h) {
    out_ += "\n" + h.text + "\n" + std::string(display_width(h.text), h.level <= 2 ? '=' : '-') + "\n";
  }
  void operator()(const Paragraph& p) { out_ += p.text + "\n\n"; }
  void operator()(const BulletList& list) {
    for (const std::string& item : list.items) out_ += "- " + item + "\n";
    out_ += "\n";
  }
  void operator()(const FigureBlock& block) { out_ += fmt::format("[Figure {}. {}]\n\n", ++figures_, block.caption); }
  void operator()(const Table& table) { out_ += to_text(table) + "\n"; }
  void operator()(const EquationBlock& block) {
    for (const Equation& equation : block.equations) out_ += "  " + to_text(equation, block.names) + "\n";
    out_ += "\n";
  }
  void operator()(const KeyValues& block) { items(block.items); }
  void operator()(const Callout& c) {
    out_ += fmt::format("{}: {}\n", kind_name(c.kind), c.title);
    if (!c.text.empty()) out_ += c.text + "\n";
    out_ += "\n";
  }
  void operator()(const Code& code) { out_ += code.text + "\n\n"; }
  void operator()(const Provenance& p) { items(items_of(p)); }

 private:
  void items(const std::vector<std::pair<std::string, std::string>>& list) {
    std::size_t width = 0;
    for (const auto& [name, value] : list) width = std::max(width, display_width(name));
    for (const auto& [name, value] : list) {
      out_ += name + std::string(width - display_width(name) + 2, ' ') + value + "\n";
    }
    out_ += "\n";
  }
  std::string out_;
  int figures_ = 0;
};

}  // namespace

Document& Document::section(std::string text) {
  blocks.emplace_back(Heading{2, std::move(text)});
  return *this;
}
Document& Document::subsection(std::string text) {
  blocks.emplace_back(Heading{3, std::move(text)});
  return *this;
}
Document& Document::paragraph(std::string text) {
  blocks.emplace_back(Paragraph{std::move(text)});
  return *this;
}
Document& Document::bullets(std::vector<std::string> items) {
  blocks.emplace_back(BulletList{std::move(items)});
  return *this;
}
Document& Document::figure(Figure drawing, std::string caption) {
  blocks.emplace_back(FigureBlock{std::move(drawing), std::move(caption)});
  return *this;
}
Document& Document::table(Table values) {
  blocks.emplace_back(std::move(values));
  return *this;
}
Document& Document::equations(const IdentifiedModel& model) {
  EquationBlock block{{}, names_of(model)};
  std::ranges::copy_if(model.equations, std::back_inserter(block.equations),
                       [&](const Equation& e) { return !says_nothing(e, block.names); });
  blocks.emplace_back(std::move(block));
  return *this;
}
Document& Document::key_values(std::vector<std::pair<std::string, std::string>> items) {
  blocks.emplace_back(KeyValues{std::move(items)});
  return *this;
}
Document& Document::callout(Callout::Kind kind, std::string heading, std::string text) {
  blocks.emplace_back(Callout{kind, std::move(heading), std::move(text)});
  return *this;
}
Document& Document::code(std::string text) {
  blocks.emplace_back(Code{std::move(text)});
  return *this;
}

Document& Document::summary(const Summary& result, std::string of_what) {
  if (result.status == Status::ok && result.trust.empty()) return *this;
  const bool good = result.status == Status::ok;
  callout(good ? Callout::Kind::note : Callout::Kind::warning,
          result.status == Status::unusable ? fmt::format("{}: unusable", of_what) : std::move(of_what), result.trust);
  if (!result.warnings.empty()) bullets(result.warnings);
  return *this;
}

Document& Document::provenance(const Provenance& origin) {
  blocks.emplace_back(origin);
  return *this;
}

std::string to_html(const Document& document) {
  HtmlWriter body;
  for (const Block& block : document.blocks) std::visit(body, block);
  std::string out =
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n"
      "<meta name=\"color-scheme\" content=\"light dark\"/>\n";
  out += "<title>" + escape_markup(document.title) + "</title>\n<style>\n";
  out += kDocumentStyle;
  out += figure_style(true) + "\n</style>\n</head>\n<body>\n<main>\n<header>\n";
  out += "<h1>" + escape_markup(document.title) + "</h1>\n";
  if (!document.subtitle.empty()) out += "<p class=\"subtitle\">" + escape_markup(document.subtitle) + "</p>\n";
  out += "</header>\n" + contents(document) + body.take() + "</main>\n<script>";
  out += kDocumentScript;
  out += "</script>\n</body>\n</html>\n";
  return out;
}

std::string to_text(const Document& document) {
  TextWriter body;
  for (const Block& block : document.blocks) std::visit(body, block);
  std::string out = document.title + "\n";
  if (!document.subtitle.empty()) out += document.subtitle + "\n";
  return out + "\n" + body.take();
}

void write_html(const Document& document, const std::filesystem::path& file, bool data) {
  if (!data) return io::write_text(file, to_html(document));
  const std::filesystem::path folder = file.parent_path() / (file.stem().string() + "_figures");
  std::vector<io::FileText> files;
  int number = 0;
  for (const Block& block : document.blocks) {
    const auto* figure = std::get_if<FigureBlock>(&block);
    if (figure == nullptr) continue;
    const std::string name = fmt::format("figure_{}", ++number);
    files.push_back({name + ".svg", to_svg(figure->figure)});
    files.push_back({name + ".csv", to_csv(figure->figure)});
  }
  io::OutputGroup together;
  io::write_files(folder, files);
  io::write_text(file, to_html(document));
  together.commit();
}

}  // namespace whirl::report
